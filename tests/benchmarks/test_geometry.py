"""Random points on meshes and distances to them, on a rectangle whose geometry is known."""

import numpy as np
import pytest

from benchmarks.geometry import border_points, closest_points, surface_points
from core import Mesh

RECTANGLE = Mesh(
    np.array([[0.0, 0, 0], [1, 0, 0], [1, 0.5, 0], [1, 3, 0], [0, 3, 0]]),
    np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]], np.int32),
)


def test_closest_points_on_faces_edges_and_corners():
    x = np.array([[0.5, 0.5, 2], [0.5, -3, 4], [-1, -2, 2]])
    distance, foot = closest_points(x, RECTANGLE)
    assert distance == pytest.approx([2, 5, 3])
    np.testing.assert_allclose(foot, [[0.5, 0.5, 0], [0.5, 0, 0], [0, 0, 0]], atol=1e-12)


def test_surface_points_are_uniform_by_area():
    x = surface_points(RECTANGLE, 60_000, np.random.default_rng(1))
    counts, *_ = np.histogram2d(x[:, 0], x[:, 1], bins=(2, 6), range=((0, 1), (0, 3)))
    assert (x[:, 2] == 0).all()
    assert counts.ravel() == pytest.approx(np.full(12, 5000), rel=0.06)


def test_border_points_lie_on_the_border_and_lead_off_it():
    x, outward, up = border_points(RECTANGLE, 8_000, np.random.default_rng(2))
    ends = {(-1, 0): (0, 0), (1, 0): (0, 1), (0, -1): (1, 0), (0, 1): (1, 3)}
    for direction, (axis, value) in ends.items():
        here = np.isclose(x[:, axis], value) & np.isclose(outward[:, :2], direction).all(axis=1)
        assert here.mean() == pytest.approx(3 / 8 if axis == 0 else 1 / 8, abs=0.02)
    np.testing.assert_allclose(np.abs(up), np.tile([0, 0, 1], (8_000, 1)), atol=1e-12)


def test_a_closed_mesh_has_no_border():
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    x, outward, up = border_points(Mesh(np.eye(4)[:, :3], faces), 10, np.random.default_rng(0))
    assert len(x) == len(outward) == len(up) == 0
