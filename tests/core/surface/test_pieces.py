import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Mesh
from core.surface.pieces import pieces_with_samples

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def triangles(*places):
    vertices = np.concatenate([TRIANGLE + place for place in places])
    return Mesh(vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3))


@pytest.mark.parametrize(("distance", "kept"), [(1.4, True), (1.6, False)])
def test_a_piece_stays_where_a_sample_is_within_one_and_a_half_cells(distance, kept):
    mesh = pieces_with_samples(triangles([0, 0, 0], [0, 0, 50]), KDTree([[0, 0, 0], [0, 0, 50 + distance * 0.5]]), 0.5)
    assert len(mesh.faces) == (2 if kept else 1)


def test_one_sample_holds_a_whole_piece_and_vertices_are_renumbered():
    strip = Mesh(
        np.array([[0, 9, 9], [9, 9, 9], [9, 0, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0], [80, 80, 0]], float),
        np.array([[0, 1, 2], [3, 4, 5], [5, 4, 6]], np.int32),
    )
    mesh = pieces_with_samples(strip, KDTree([[0.0, 0, 0]]), 1.0)
    np.testing.assert_array_equal(mesh.vertices, strip.vertices[3:])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [2, 1, 3]])
    assert mesh.faces.dtype == np.int32


def test_nothing_left():
    mesh = pieces_with_samples(triangles([0, 0, 0]), KDTree([[9.0, 9, 9]]), 1.0)
    assert (mesh.vertices.shape, mesh.faces.shape) == ((0, 3), (0, 3))
