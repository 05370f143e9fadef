"""Surface, mesh and normal metrics against closed forms."""

import numpy as np
import pytest

from benchmarks.metrics import cover_euler, normal_agreement, surface_errors, topology
from core import Mesh

TETRAHEDRON = Mesh(
    np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0], [0.5, 3**0.5 / 6, (2 / 3) ** 0.5]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32),
)
THREE_SHEETS = Mesh(
    np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]]),
    np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]], np.int32),
)


def square(side=1.0, height=0.0) -> Mesh:
    corners = side * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) + [0, 0, height]
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def test_parallel_squares_are_their_distance_apart():
    found = surface_errors(square(height=0.007), square())
    lengths = ("cd", "hd", "to_truth_mean", "to_truth_max", "to_mesh_mean", "to_mesh_max")
    assert [found[name] for name in lengths] == pytest.approx([7.0] * 6)
    assert (found["f005"], found["f010"]) == (0, 1)


def test_the_two_sides_tell_missing_from_too_much():
    found = surface_errors(square(0.5), square())
    assert (found["to_truth_mean"], found["to_truth_max"]) == pytest.approx((0, 0), abs=1e-9)
    # the distance to the half square, integrated: two strips of .5 x .5 at a mean of .25, and a corner of .5 x .5
    corner = (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 3 * 0.5
    assert found["to_mesh_mean"] == pytest.approx(1e3 * (2 * 0.25 * 0.25 + 0.25 * corner), rel=0.01)
    assert found["to_mesh_max"] == pytest.approx(1e3 * 0.5**0.5, rel=0.01)
    assert found["cd"] == pytest.approx(found["to_mesh_mean"] / 2)
    assert found["hd"] == found["to_mesh_max"]
    within = 0.505**2
    assert found["f005"] == pytest.approx(2 * within / (1 + within), abs=0.003)


@pytest.mark.parametrize(
    ("mesh", "components", "euler", "border", "nonmanifold"),
    [(TETRAHEDRON, 1, 2, 0, 0), (square(), 1, 1, 4, 0), (THREE_SHEETS, 1, 1, 6, 1)],
)
def test_topology(mesh, components, euler, border, nonmanifold):
    twice = Mesh(
        np.concatenate([mesh.vertices, mesh.vertices + 5, [[9.0, 9, 9]]]),
        np.concatenate([mesh.faces, mesh.faces + len(mesh.vertices)]),
    )
    for found, pieces in ((topology(mesh), 1), (topology(twice), 2)):
        assert found == {
            "components": components * pieces,
            "euler": euler * pieces,
            "border_edges": border * pieces,
            "nonmanifold_edges": nonmanifold * pieces,
        }


def test_the_cover_of_a_sheet_is_a_sphere_and_of_a_sphere_two():
    none, crossing = np.empty((0, 3)), np.zeros((1, 3))
    assert cover_euler(square(), none) == 2
    assert cover_euler(TETRAHEDRON, none) == 4
    assert cover_euler(THREE_SHEETS, crossing) == 2
    assert cover_euler(square(), crossing) is None


def test_normal_agreement_ignores_signs_and_looks_near_the_curve():
    true = np.tile([0.0, 0, 1], (100, 1))
    tilt = np.radians(np.where(np.arange(100) < 10, 60, 0))
    axes = np.stack([np.sin(tilt), 0 * tilt, np.cos(tilt)], axis=1) * np.where(np.arange(100) % 2, -1, 1)[:, None]
    points = np.stack([np.arange(100.0), np.zeros(100), np.zeros(100)], axis=1)
    found = normal_agreement(axes, true, points, points[5:15] + np.array([0, 0.049, 0]))
    assert found == pytest.approx({"nc": 0.95, "nc_p05": 0.5, "nc_curve": 0.75})
    assert normal_agreement(axes, true, points, points[:1] + np.array([0, 0.051, 0]))["nc_curve"] is None
