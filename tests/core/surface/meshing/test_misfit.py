"""The distance of samples to a mesh, by closed form and against exact distances."""

from types import SimpleNamespace

import igl
import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Mesh
from core.surface.meshing.misfit import askew, chamfer, distances, left_out, misfit

SQUARE = Mesh(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def test_points_above_a_square():
    points = np.random.default_rng(0).uniform([0, 0, -1], [1, 1, 1], (500, 3))
    assert distances(SQUARE, points).mean() == pytest.approx(np.abs(points[:, 2]).mean())


def test_points_that_the_mesh_does_not_reach():
    assert distances(SQUARE, np.array([[9.0, 0.5, 0]])).mean() == pytest.approx(8, abs=0.5)


def test_agrees_with_exact_distances_to_the_triangles():
    rng = np.random.default_rng(0)
    at = np.linspace(0, 3, 21)
    x, y = (each.reshape(-1) for each in np.meshgrid(at, at, indexing="ij"))
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1, 1)
    faces = (corner + np.array([[[0, 21, 22]], [[0, 22, 1]]])).reshape(-1, 3).astype(np.int32)
    mesh = Mesh(np.column_stack([x, y, np.sin(2 * x) * np.cos(y)]), faces)
    points = mesh.vertices[rng.integers(0, len(x), 2000)] + rng.normal(0, 0.1, (2000, 3))
    exact = np.sqrt(igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)[0]).mean()
    assert 0.9 * exact < distances(mesh, points).mean() <= 1.001 * exact


def test_what_a_mesh_leaves_out_is_more_than_a_cell_off_it():
    """Beside vertices a cell apart and beside faces that are much larger than a cell, of which some are far from any
    vertex."""
    points = np.random.default_rng(0).uniform([0, 0, -0.3], [1, 1, 0.3], (500, 3))
    for cell in (1.0, 0.2, 0.05):
        far = np.abs(points[:, 2]) > cell
        np.testing.assert_array_equal(left_out(SQUARE, points, cell), points[far])
    assert len(left_out(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)), points, 1.0)) == 500


def test_no_faces():
    assert distances(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)), np.zeros((1, 3))) == np.inf


def test_many_points_count_alike():
    points = np.random.default_rng(0).uniform([0, 0, 0], [1, 1, 1], (20_000, 3))
    points = points[np.argsort(points[:, 2])]
    assert distances(SQUARE, points).mean() == pytest.approx(points[:, 2].mean(), rel=0.01)


def test_how_much_is_turned_away_from_the_samples():
    """A floor and a steep wall over samples of the floor's plane."""
    x, y, z = [0, 0, 3, 3, 3.1, 3.1], [0, 1, 0, 1, 0, 1], [0, 0, 0, 0, 1.5, 1.5]
    mesh = Mesh(np.column_stack([x, y, z]), np.array([[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]], np.int32))
    samples = np.random.default_rng(0).uniform([0, 0, 0], [4, 1, 0], (500, 3))
    normals = np.tile([0, 0, -1.0], (500, 1))
    wall = np.hypot(0.1, 1.5)
    assert askew(mesh, KDTree(samples), normals) == pytest.approx(wall / (3 + wall))


def test_of_no_faces_all_is_turned_away():
    none = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))
    assert askew(none, KDTree(np.zeros((1, 3))), np.array([[0, 0, 1.0]])) == 1


@pytest.mark.parametrize(
    ("height", "tilt", "worst", "missed"),
    [(0, 0, 0, 0), (0.14, 0, 2, 0), (0.49, 0, 7, 0), (0.51, 0, 7.3, 1), (0, 50, 10, 0)],
)
def test_the_worse_of_distance_and_turn_tells_the_misfit(height, tilt, worst, missed):
    """Heights in cells, here of 2; .07 of them, or a tenth of the area askew, is 1."""
    points = np.random.default_rng(0).uniform([0.2, 0.2, 2 * height], [0.8, 0.8, 2 * height], (500, 3))
    normal = [np.sin(np.radians(tilt)), 0, np.cos(np.radians(tilt))]
    surface = SimpleNamespace(points=points, normals=np.tile(normal, (500, 1)), tree=KDTree(points))
    assert misfit(SQUARE, surface, 2.0) == (pytest.approx(worst, abs=0.1), missed)


def test_the_chamfer_distance_counts_what_is_too_much_and_what_is_missing():
    """Half the samples lie .4 above the mesh, and half of the second mesh 3 above the surface; in cells of 2."""
    square = np.random.default_rng(0).uniform([0, 0, 0], [1, 1, 0], (500, 3))
    up, faces = np.array([0, 0, 1.0]), np.concatenate([SQUARE.faces, SQUARE.faces + 4])
    surface = SimpleNamespace(points=np.concatenate([square, square + 0.4 * up]), project=onto_the_ground)
    two = Mesh(np.concatenate([SQUARE.vertices, SQUARE.vertices + 3 * up]), faces)
    assert chamfer(SQUARE, surface, 2.0) == pytest.approx(0.1)
    assert chamfer(two, surface, 2.0) == pytest.approx(0.1 + 0.75)


def onto_the_ground(x):
    """Onto the plane z = 0."""
    return SimpleNamespace(distance=np.abs(x[:, 2]))


def test_no_faces_are_infinitely_far():
    surface = SimpleNamespace(points=np.zeros((1, 3)), project=onto_the_ground)
    assert chamfer(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)), surface, 1.0) == np.inf
    assert chamfer(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32)), surface, 1.0) == np.inf


def test_a_mesh_without_area_is_turned_away_from_all():
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [2, 1e-14, 0]]), np.array([[0, 1, 2]], np.int32))
    assert askew(mesh, KDTree(mesh.vertices), np.tile([0.0, 0, 1], (3, 1))) == 1
