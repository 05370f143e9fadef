"""Surfaces in closed form: topology as in the books, samples and normals on the formula, samplings as they say."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from benchmarks.geometry import closest_faces, face_normals
from benchmarks.metrics import topology
from benchmarks.sampling import blue_noise, graded, pierced, uniform, wires
from benchmarks.shapes import bordered, junctions, one_sided
from benchmarks.shapes.panels import box
from benchmarks.shapes.surface import Patch, from_implicit, from_mesh, from_patches, sample, with_crossings


def torus(steps=(120, 50)):
    def position(uv):
        u, v = 2 * np.pi * uv.T
        return np.stack([(1 + 0.4 * np.cos(v)) * np.cos(u), (1 + 0.4 * np.cos(v)) * np.sin(u), 0.4 * np.sin(v)], axis=1)

    return from_patches([Patch(position, steps)])


def off_torus(points):
    """Signed distance to the torus of `torus` and its unit gradient; 0.8 / 2.8 is the scale of its fit."""
    x = points * 3.5
    ring = np.hypot(x[:, 0], x[:, 1])
    middle = np.column_stack([x[:, :2] / ring[:, None], np.zeros(len(x))])
    away = x - middle
    return np.linalg.norm(away, axis=1) - 0.4, away / np.linalg.norm(away, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("make", "euler", "loops", "at_junctions"),
    [
        (bordered.curtain, 1, 1, 0),
        (one_sided.moebius, 0, 1, 0),
        (junctions.t_junction, 1, 1, 1),
        (junctions.paper_plane, 1, 1, 1),
        (junctions.box_axis, 1, 1, 12),
        (junctions.fish, 2, 3, 198),
        (junctions.strawberry, 2, 1, 360),
    ],
)
def test_sheets_are_welded_where_they_meet(make, euler, loops, at_junctions):
    surface = make()
    found = topology(surface.mesh)
    assert (found["euler"], found["nonmanifold_edges"]) == (euler, at_junctions)
    assert surface.mesh.border_loops() == loops
    vertices = surface.mesh.vertices
    assert np.ptp(vertices, axis=0).max() == pytest.approx(0.8)
    np.testing.assert_allclose(vertices.min(axis=0) + vertices.max(axis=0), 0, atol=1e-12)
    points, _ = sample(surface, 300, np.random.default_rng(0))
    for on_surface in (points, surface.curve):
        if len(on_surface):
            assert closest_faces(on_surface, surface.mesh)[0].max() < 1e-4


def test_samples_lie_on_the_formula_with_its_normals():
    points, normals = sample(torus(), 500, np.random.default_rng(0))
    distance, gradient = off_torus(points)
    np.testing.assert_allclose(distance, 0, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", normals, gradient)), 1, atol=1e-9)


def test_samples_are_uniform_by_area():
    """The outer half of the torus has (1 + 2 r / pi R) / 2 of the area."""
    points, _ = sample(torus(), 20_000, np.random.default_rng(0))
    outer = (np.hypot(points[:, 0], points[:, 1]) * 3.5 > 1).mean()
    assert outer == pytest.approx(0.5 + 0.4 / np.pi, abs=0.01)


def test_implicit_surfaces_are_exact_too():
    ball = from_implicit(lambda x: (x**2).sum(axis=1) - 1, 1.3, 40)
    points, normals = sample(ball, 500, np.random.default_rng(0))
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.4, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), np.linalg.norm(points[0]), atol=1e-4)
    direction = points / np.linalg.norm(points, axis=1, keepdims=True)
    assert np.abs(np.einsum("ni,ni->n", normals, direction)).min() > 1 - 1e-6
    assert topology(ball.mesh)["euler"] == 2
    cut = from_implicit(lambda x: (x**2).sum(axis=1) - 1, 0.9, 40)
    assert cut.mesh.border_loops() == 6


def test_triangles_are_their_own_surface():
    cube = from_mesh(from_patches(box((0, 0, 0), (1, 1, 1))).mesh)
    points, normals = sample(cube, 300, np.random.default_rng(0))
    np.testing.assert_allclose(np.abs(points).max(axis=1), 0.4)
    distance, face = closest_faces(points, cube.mesh)
    np.testing.assert_allclose(distance, 0, atol=1e-7)
    np.testing.assert_allclose(np.einsum("ni,ni->n", normals, face_normals(cube.mesh)[face]), 1)


def test_crossings_are_found_where_sheets_cross():
    def plane(normal):
        return Patch(lambda uv: np.insert(2 * uv - 1, normal, 0.0, axis=1), (10, 10))

    curve = with_crossings(from_patches([plane(0), plane(2)])).curve
    assert len(curve) > 10
    assert np.abs(curve[:, [0, 2]]).max() < 0.003
    assert np.ptp(curve[:, 1]) > 0.7
    assert not len(with_crossings(torus()).curve)


def test_blue_noise_keeps_its_distance():
    surface, rng = torus(), np.random.default_rng(0)
    for take, least in ((uniform, 0.0), (blue_noise, 0.85)):
        points, normals = take(surface, 800, rng)
        assert points.shape == normals.shape == (800, 3)
        np.testing.assert_allclose(off_torus(points)[0], 0, atol=1e-12)
        nearest = KDTree(points).query(points, 2)[0][:, 1]
        assert nearest.min() >= least * nearest.mean()
    assert nearest.std() < 0.12 * nearest.mean()


def test_spoiled_samplings_are_as_they_say():
    surface, rng = torus(), np.random.default_rng(0)
    points, _ = graded(surface, 2_000, rng)
    left, right = ((points[:, 0] * side > 0.2).sum() for side in (-1, 1))
    assert 5 < left / right < 30

    whole, _ = blue_noise(surface, 2_000, np.random.default_rng(1))
    holed, _ = pierced(surface, 2_000, np.random.default_rng(1), holes=5, width=6.0)
    spacing = KDTree(whole).query(whole, 7)[0][:, 1:].mean()
    to_left = KDTree(holed).query(whole)[0]
    assert 50 < len(whole) - len(holed) < 300
    assert 2 * spacing < to_left.max() <= 3.5 * spacing

    caged, _ = wires(surface, 300, rng, planes=4, thickness=0.01)
    planes = np.array([-0.3, -0.1, 0.1, 0.3])
    assert np.abs(caged[:, :, None] - planes).min(axis=(1, 2)).max() <= 0.005
