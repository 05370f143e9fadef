import numpy as np
import pytest

from core import Mesh
from core.surface.mesh import in_use

TETRAHEDRON = Mesh(
    np.concatenate([np.zeros((1, 3)), np.eye(3)]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32),
)


def test_a_closed_mesh_has_two_faces_at_each_edge():
    edges, counts = TETRAHEDRON.edge_counts()
    assert edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert counts.tolist() == [2] * 6


def test_a_border_edge_has_one():
    edges, counts = Mesh(TETRAHEDRON.vertices, TETRAHEDRON.faces[:3]).edge_counts()
    assert {tuple(edge) for edge in edges[counts == 1]} == {(1, 2), (2, 3), (1, 3)}


def test_a_junction_edge_has_more():
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0]], float)
    edges, counts = Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32)).edge_counts()
    assert dict(zip(map(tuple, edges.tolist()), counts.tolist(), strict=True))[0, 1] == 3
    assert sorted(counts.tolist()) == [1] * 6 + [3]


def test_vertices_of_faces_and_faces_at_vertices():
    mesh = Mesh(np.zeros((5, 3)), np.array([[0, 1, 2], [2, 1, 3], [3, 1, 4]], np.int32))
    for chosen in ([0], np.array([True, False, False])):
        assert np.flatnonzero(mesh.vertices_of(chosen)).tolist() == [0, 1, 2]
    for vertex, faces in ((0, [0]), (1, [0, 1, 2]), (2, [0, 1]), (4, [2])):
        assert np.flatnonzero(mesh.faces_at(np.arange(5) == vertex)).tolist() == faces


def test_areas_in_closed_form():
    np.testing.assert_allclose(TETRAHEDRON.face_areas(), [0.5, 0.5, 0.5, np.sqrt(3) / 2])


@pytest.mark.parametrize("factor", [1e-3, 7.0])
def test_areas_grow_with_the_square(factor):
    scaled = Mesh(TETRAHEDRON.vertices * factor + 5, TETRAHEDRON.faces)
    np.testing.assert_allclose(scaled.face_areas(), TETRAHEDRON.face_areas() * factor**2)


def test_no_faces():
    empty = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))
    edges, counts = empty.edge_counts()
    assert (edges.shape, counts.shape, empty.face_areas().shape) == ((0, 2), (0,), (0,))


# two quads and a triangle, in a row
STRIP = Mesh(
    np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0], [3, 0, 0]], float),
    np.array([[0, 1, 4], [1, 2, 5], [0, 4, 3], [1, 5, 4], [2, 6, 5]], np.int32),
    pairs=2,
)


def test_pairs_of_faces_are_quads():
    assert STRIP.quads.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4]]
    assert STRIP.triangles.tolist() == [[2, 6, 5]]
    assert (TETRAHEDRON.quads.shape, len(TETRAHEDRON.triangles)) == ((0, 4), 4)


@pytest.mark.parametrize(
    ("gone", "quads", "triangles"),
    [
        ([], [[0, 1, 4, 3], [1, 2, 5, 4]], [[2, 6, 5]]),
        ([4], [[0, 1, 4, 3], [1, 2, 5, 4]], []),
        ([0, 2], [[1, 2, 5, 4]], [[2, 6, 5]]),
        ([0], [[1, 2, 5, 4]], [[0, 4, 3], [2, 6, 5]]),
        ([3], [[0, 1, 4, 3]], [[1, 2, 5], [2, 6, 5]]),
    ],
)
def test_a_quad_that_loses_a_half_is_a_triangle(gone, quads, triangles):
    found = STRIP.of_faces(~np.isin(np.arange(5), gone))
    assert (found.quads.tolist(), found.triangles.tolist()) == (quads, triangles)
    assert len(found.faces) == 5 - len(gone)


def test_quads_that_are_not_to_be_are_triangles():
    found = STRIP.with_quads(np.array([False, True]))
    assert found.quads.tolist() == [[1, 2, 5, 4]]
    assert found.triangles.tolist() == [[0, 1, 4], [0, 4, 3], [2, 6, 5]]


def test_joined_meshes_keep_faces_and_quads():
    found = STRIP.joined(TETRAHEDRON).joined(STRIP)
    assert found.quads.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4], [11, 12, 15, 14], [12, 13, 16, 15]]
    assert found.triangles.tolist() == [[2, 6, 5], *(TETRAHEDRON.faces + 7).tolist(), [13, 17, 16]]
    np.testing.assert_array_equal(found.vertices[7:11], TETRAHEDRON.vertices)


def test_vertices_out_of_use_are_left_out():
    vertices, faces = in_use(np.arange(24.0).reshape(8, 3), np.array([[7, 1, 3], [3, 1, 4]]))
    np.testing.assert_array_equal(vertices[:, 0], [3, 9, 12, 21])
    np.testing.assert_array_equal(faces, [[3, 0, 1], [1, 0, 2]])


def test_a_mesh_with_its_vertices_moved_has_the_same_edges():
    moved = STRIP.moved(STRIP.vertices + 1)
    np.testing.assert_array_equal(moved.vertices, STRIP.vertices + 1)
    assert (moved.faces is STRIP.faces, moved.pairs, moved.edges is STRIP.edges) == (True, 2, True)
    assert STRIP.of_faces(np.arange(5) < 4).edges is not STRIP.edges
