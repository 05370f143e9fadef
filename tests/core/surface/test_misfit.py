"""The distance of samples to a mesh, by closed form and against exact distances."""

import igl
import numpy as np
import pytest

from core import Mesh
from core.surface.misfit import misfit

SQUARE = Mesh(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def test_points_above_a_square():
    points = np.random.default_rng(0).uniform([0, 0, -1], [1, 1, 1], (500, 3))
    assert misfit(SQUARE, points) == pytest.approx(np.abs(points[:, 2]).mean())


def test_points_that_the_mesh_does_not_reach():
    assert misfit(SQUARE, np.array([[9.0, 0.5, 0]])) == pytest.approx(8, abs=0.5)


def test_agrees_with_exact_distances_to_the_triangles():
    rng = np.random.default_rng(0)
    at = np.linspace(0, 3, 21)
    x, y = (each.reshape(-1) for each in np.meshgrid(at, at, indexing="ij"))
    corner = (np.arange(20)[:, None] * 21 + np.arange(20)).reshape(-1, 1)
    faces = (corner + np.array([[[0, 21, 22]], [[0, 22, 1]]])).reshape(-1, 3).astype(np.int32)
    mesh = Mesh(np.column_stack([x, y, np.sin(2 * x) * np.cos(y)]), faces)
    points = mesh.vertices[rng.integers(0, len(x), 2000)] + rng.normal(0, 0.1, (2000, 3))
    exact = np.sqrt(igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)[0]).mean()
    assert 0.9 * exact < misfit(mesh, points) <= 1.001 * exact


def test_no_faces():
    assert misfit(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)), np.zeros((1, 3))) == np.inf


def test_many_points_count_alike():
    points = np.random.default_rng(0).uniform([0, 0, 0], [1, 1, 1], (20_000, 3))
    points = points[np.argsort(points[:, 2])]
    assert misfit(SQUARE, points) == pytest.approx(points[:, 2].mean(), rel=0.01)
