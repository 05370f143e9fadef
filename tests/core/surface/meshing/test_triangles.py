import numpy as np
import pytest

from core import Mesh
from core.surface.meshing.triangles import mesh_of, triangles

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)


def test_triangles_come_back():
    faces = np.array([[0, 1, 2]])
    assert triangles(SQUARE, faces) is faces


@pytest.mark.parametrize(("corner", "diagonal"), [(0, {0, 2}), (1, {1, 3}), (2, {0, 2}), (3, {1, 3})])
def test_the_shorter_diagonal_splits_a_quad(corner, diagonal):
    vertices = SQUARE.copy()
    vertices[corner] += 0.4 * (0.5 - vertices[corner])
    faces = triangles(vertices, np.array([[0, 1, 2, 3]]))
    assert set.intersection(*map(set, faces.tolist())) == diagonal


def rhombic_grid(n, bend):
    """Squares of side .1, n by n, whose diagonals run along and across a cylinder of curvature `bend`."""
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    along, across = 0.1 * np.stack([i + j, i - j]).reshape(2, -1) / np.sqrt(2)
    vertices = np.stack([along, np.sin(bend * across) / bend, np.cos(bend * across) / bend], axis=1)
    corner = np.arange(n * n).reshape(n, n)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1).reshape(-1, 4)
    return vertices, quads, along


def test_quads_of_a_cylinder_are_split_along_it():
    vertices, quads, along = rhombic_grid(12, 1.0)
    faces = triangles(vertices, quads)
    inner = ~np.isin(quads, np.flatnonzero(np.bincount(quads.ravel()) < 4)).any(axis=1)
    first = faces[: len(quads)][inner]
    split = np.abs(along[first[:, 2]] - along[first[:, 0]])
    np.testing.assert_allclose(split, 0.1 * np.sqrt(2))


def test_the_quads_of_a_mesh_are_those_it_was_made_of():
    """Wound alike, whichever corner comes first."""
    vertices = np.concatenate([SQUARE, SQUARE[1:3] * [2, 1.5, 1]])
    quads = np.array([[0, 1, 2, 3], [1, 4, 5, 2]])
    mesh = mesh_of(vertices, quads)
    for given, found in zip(quads.tolist(), mesh.quads.tolist(), strict=True):
        assert found in [given[k:] + given[:k] for k in range(4)]
    assert (mesh.faces.dtype, len(mesh.triangles)) == (np.int32, 0)
    assert mesh_of(SQUARE, np.array([[0, 1, 2]])).pairs == 0


def test_area_and_winding_stay():
    faces = triangles(SQUARE, np.array([[0, 1, 2, 3]]))
    a, b, c = (SQUARE[faces[:, k]] for k in range(3))
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], [1, 1])


def test_a_diagonal_is_never_an_edge_that_is_there_already():
    """Two quads with an edge of the second along the shorter diagonal of the first."""
    vertices = np.concatenate([SQUARE * [1, 0.9, 1] + [0.05, 0, 0], [[0, 0, 1], [1, 1, 1]]])
    vertices[1] += [0.3, -0.3, 0]  # makes 0-2 the shorter
    mesh = Mesh(vertices, triangles(vertices, np.array([[0, 1, 2, 3], [0, 2, 5, 4]])))
    assert mesh.edge_counts()[1].max() <= 2


def test_two_quads_on_the_same_corners_get_both_diagonals():
    """A flat pocket: closed, and still with two faces at each edge."""
    mesh = Mesh(SQUARE, triangles(SQUARE, np.array([[0, 1, 2, 3], [0, 3, 2, 1]])))
    assert set(mesh.edge_counts()[1]) == {2}
