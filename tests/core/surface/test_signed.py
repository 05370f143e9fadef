"""Signed distance of closed shapes against closed forms, and the refusal of others."""

import re
from dataclasses import replace

import igl
import numpy as np
import pytest

from core import InputError, Settings, estimate_normals, reconstruct
from core.field.grid import fit_grid
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.progress import Progress
from core.surface.meshing.corners import into_corners
from core.surface.meshing.finishing import sharpened
from core.surface.signed import signed_mesh
from tests import shapes


def signed(points, **settings):
    return reconstruct(points, Settings(**{"resolution": 36, "surface": "signed", **settings}))


SECOND = np.array([2.5, 0, 0])
FLAP = shapes.disc(300, 0.4) + np.array([0, 0, 1.6])


def hollow():
    return np.concatenate([shapes.sphere(2000), shapes.sphere(700, 0.5)])


def pair():
    return np.concatenate([shapes.sphere(1000), shapes.sphere(1000) + SECOND])


# points, signed distance, Euler characteristic and volume of the pieces
SHAPES = {
    "sphere": (shapes.sphere(1500), lambda x: np.linalg.norm(x, axis=1) - 1, [2], [4 / 3 * np.pi]),
    "scattered": (shapes.scattered_sphere(1500), lambda x: np.linalg.norm(x, axis=1) - 1, [2], [4 / 3 * np.pi]),
    "torus": (
        shapes.torus(2000),
        lambda x: np.hypot(np.hypot(x[:, 0], x[:, 1]) - 1, x[:, 2]) - 0.4,
        [0],
        [2 * np.pi**2 * 0.16],
    ),
    "cube": (
        shapes.cube(2400),
        lambda x: np.linalg.norm(np.maximum(np.abs(x) - 1, 0), axis=1) + np.minimum(np.abs(x).max(axis=1) - 1, 0),
        [2],
        [8.0],
    ),
    "hollow": (
        hollow(),
        lambda x: np.maximum(np.linalg.norm(x, axis=1) - 1, 0.5 - np.linalg.norm(x, axis=1)),
        [2, 2],
        [4 / 3 * np.pi, -4 / 3 * np.pi / 8],
    ),
    "pair": (
        pair(),
        lambda x: np.minimum(np.linalg.norm(x, axis=1), np.linalg.norm(x - SECOND, axis=1)) - 1,
        [2, 2],
        [4 / 3 * np.pi] * 2,
    ),
}


@pytest.fixture(scope="module")
def runs():
    return {name: signed(points) for name, (points, *_) in SHAPES.items()}


@pytest.mark.parametrize("name", SHAPES)
def test_values_are_negative_inside_and_right(runs, name):
    field = runs[name].field
    true = SHAPES[name][1](shapes.node_positions(field))
    off = np.abs(field.values.ravel() - true) / field.spacing
    clear = np.abs(true) > (0.8 if name == "cube" else 0.3) * field.spacing  # its edges are a little rounded
    assert field.sdf
    assert ((field.values.ravel() < 0) == (true < 0))[clear].all()
    assert off.mean() < 0.1
    assert np.percentile(off, 99) < 0.6


@pytest.mark.parametrize("name", SHAPES)
def test_the_mesh_is_closed_and_faces_outwards(runs, name):
    _, _, euler, volume = SHAPES[name]
    surface = runs[name].surface
    pieces = shapes.components(surface)
    assert set(surface.edge_counts()[1]) == {2}
    assert [shapes.euler(piece) for piece in pieces] == euler
    assert [shapes.signed_volume(piece) for piece in pieces] == pytest.approx(volume, rel=0.05)
    assert runs[name].sheet is None
    assert runs[name].report["warnings"] == []
    assert list(runs[name].report["meshes"]) == ["signed"]


@pytest.mark.parametrize(("name", "hair"), [("sphere", 0.02), ("torus", 0.02), ("scattered", 0.15)])
def test_vertices_lie_on_the_surface(runs, name, hair):
    off = np.abs(SHAPES[name][1](runs[name].surface.vertices)) / runs[name].report["spacing"]
    assert off.max() < hair


def test_an_offset_that_the_box_has_no_room_for_does_not_matter():
    """A flat ellipsoid, where the double cover is looked at, too."""
    run = signed(shapes.sphere(480) * [1, 1, 0.12], resolution=32, offset=4)
    assert set(run.surface.edge_counts()[1]) == {2}
    assert shapes.signed_volume(run.surface) == pytest.approx(0.12 * 4 / 3 * np.pi, rel=0.15)


def test_places_are_told_far_from_the_origin():
    """Of a map's coordinates six digits are kilometres."""
    points = shapes.hemisphere(1500) + np.array([500_000, 5_400_123.4, 100])
    with pytest.raises(InputError, match="not closed") as told:
        signed(points)
    place = np.array(str(told.value).split("near (")[1].split(")")[0].split(","), float)
    assert np.linalg.norm(points - place, axis=1).min() < 1e-2


@pytest.mark.parametrize("shape", ["hemisphere", "disc", "cylinder", "moebius", "junction"])
def test_an_open_shape_is_refused_with_the_reason_and_a_place(shape):
    points = getattr(shapes, shape)(1500) * 10 + 100
    with pytest.raises(
        InputError, match=r"not closed: .* \d+ border samples.*set surface to single.*bridge \(now 3\)"
    ) as told:
        signed(points)
    assert "\n" not in str(told.value)
    place = np.array(str(told.value).split("near (")[1].split(")")[0].split(","), float)
    assert np.linalg.norm(points - place, axis=1).min() < 1e-3


def test_raising_bridge_closes_a_hole():
    points = shapes.sphere(2000)
    points = points[points[:, 2] < 0.98]
    with pytest.raises(InputError, match="raise bridge"):
        signed(points, bridge=1.5)
    run = signed(points, bridge=10.0)
    assert shapes.euler(run.surface) == 2
    assert shapes.signed_volume(run.surface) == pytest.approx(4 / 3 * np.pi, rel=0.02)


def test_raising_bridge_is_not_advised_beyond_its_most():
    cap = shapes.sphere(1500)
    with pytest.raises(InputError, match="or close its holes"):
        reconstruct(cap[cap[:, 2] < 0.6], Settings(resolution=32, surface="signed", bridge=20))


@pytest.mark.parametrize(("inner", "said"), [(0.97, "one of them is missing"), (0.94, "torn|missing|same side")])
def test_walls_thinner_than_a_cell_that_are_lost_are_told(inner, said):
    ball = np.concatenate([shapes.sphere(1500), shapes.sphere(1300, inner)])
    try:
        warnings = reconstruct(ball, Settings(resolution=64, surface="signed")).report["warnings"]
    except InputError as error:
        warnings = [str(error)]
    assert any(re.search(said, warning) for warning in warnings)


def test_a_spanned_opening_is_smooth():
    """Signed values in steps of a cell where a sphere has lost its cap: a staircase, until it is smoothed."""
    points = shapes.sphere(2000)
    points = points[points[:, 2] < 0.8]
    grid = fit_grid(shapes.sphere(2000), 36)
    x = grid.positions(np.arange(np.prod(grid.shape)))
    radius = np.linalg.norm(x, axis=1)
    away = np.where(x[:, 2] > 0.8 * radius, 3 * grid.spacing, np.abs(radius - 1))
    values = (np.sign(radius - 1) * away).reshape(grid.shape).astype(np.float32)
    surface = fit_local_surface(points, points / np.linalg.norm(points, axis=1, keepdims=True), np.ones(len(points)),
                                local_spacing(points), 3.0)  # fmt: skip
    mesh = signed_mesh(values, np.empty((0, 3)), np.zeros(len(points), bool), surface, grid)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    cap = (a[:, 2] > 0.75) & (np.hypot(a[:, 0], a[:, 1]) < 0.4)
    slope = normal[cap, 2] / np.linalg.norm(normal[cap], axis=1)
    assert cap.sum() > 50
    assert np.percentile(slope, 5) > 0.85
    assert set(mesh.edge_counts()[1]) == {2}


def test_the_place_named_is_at_the_opening():
    points = shapes.sphere(2000)
    with pytest.raises(InputError, match=r"near \(") as told:
        signed(points[points[:, 2] < 0.9], resolution=48, bridge=1.5)
    assert float(re.search(r"near \(.*?, .*?, (.*?)\)", str(told.value))[1]) > 0.85


def test_a_wall_inside_is_refused():
    with pytest.raises(InputError, match=r"inner walls.*set surface to single"):
        signed(np.concatenate([shapes.cube(2400), shapes.square(400)]))


def test_a_flap_has_a_face_on_either_side_and_is_told():
    run = signed(np.concatenate([shapes.sphere(1500), FLAP]))
    ball, flap = shapes.components(run.surface)
    assert shapes.euler(ball) == shapes.euler(flap) == 2
    np.testing.assert_allclose(flap.vertices[:, 2], 1.6, atol=0.05 * run.field.spacing)
    assert flap.face_areas().sum() == pytest.approx(2 * np.pi * 0.4**2, rel=0.1)
    assert shapes.signed_volume(run.surface) == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert [warning for warning in run.report["warnings"] if "same side on both faces" in warning]


def test_same_points_same_bytes(runs):
    again = signed(shapes.sphere(1500))
    assert again.field.values.tobytes() == runs["sphere"].field.values.tobytes()
    assert again.surface.vertices.tobytes() == runs["sphere"].surface.vertices.tobytes()
    assert again.surface.faces.tobytes() == runs["sphere"].surface.faces.tobytes()


def test_distances_are_those_of_the_unsigned_field(runs):
    plain = reconstruct(shapes.sphere(1500), Settings(resolution=36, surface="none")).field
    np.testing.assert_array_equal(np.abs(runs["sphere"].field.values), plain.values)
    assert not plain.sdf


@pytest.mark.parametrize("inward", [False, True])
def test_creases_are_kept(inward):
    """A tetrahedron: its edges were .36 cells off the mesh, on average, when that only went where signs change. From
    inside, as a cavity in a ball, they are inward ones."""
    rng, corners = np.random.default_rng(0), np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    corners = corners @ shapes.random_rotation(3).T
    points = np.concatenate([rng.dirichlet([1, 1, 1], 700) @ np.delete(corners, k, axis=0) for k in range(4)])
    share = rng.uniform(0.1, 0.9, (100, 1))
    ends = [(corners[a], corners[b]) for a in range(4) for b in range(a)]
    edges = np.concatenate([share * a + (1 - share) * b for a, b in ends])
    if inward:
        points = np.concatenate([points, shapes.sphere(2000, 2.2)])
    run = signed(points, resolution=70 if inward else 48, denoise=0)
    off = np.sqrt(igl.point_mesh_squared_distance(edges, run.surface.vertices, run.surface.faces)[0])
    assert off.mean() < 0.15 * run.field.spacing
    assert {shapes.euler(piece) for piece in shapes.components(run.surface)} == {2}
    assert set(run.surface.edge_counts()[1]) == {2}


def test_creases_are_sharpened_by_the_faces_beside_them(monkeypatch):
    points, seen = shapes.cube(2400), []
    spacing = local_spacing(points)
    normals, confidence, _ = estimate_normals(points, spacing)
    surface, grid = fit_local_surface(points, normals, confidence, spacing, 3.0), fit_grid(points, 32)
    mesh = signed(points, resolution=32).surface
    blunt = replace(mesh, vertices=mesh.vertices * (1 - 0.3 * grid.spacing * np.abs(mesh.vertices)))
    found = sharpened(blunt, np.zeros(len(points), bool), surface, grid.spacing, Progress())

    def by_all(vertices, faces, *rest):
        seen.append(len(faces))
        return into_corners(vertices, blunt.faces, *rest)

    monkeypatch.setattr("core.surface.meshing.finishing.into_corners", by_all)
    expected = sharpened(blunt, np.zeros(len(points), bool), surface, grid.spacing, Progress())
    assert 0 < max(seen) < 0.5 * len(blunt.faces)
    assert np.linalg.norm(found.vertices - blunt.vertices, axis=1).max() > 0.1 * grid.spacing
    np.testing.assert_array_equal(found.vertices, expected.vertices)
