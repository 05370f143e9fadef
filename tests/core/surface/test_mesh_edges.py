import numpy as np
import pytest

from core.surface.mesh_edges import Edges


@pytest.fixture(params=[3, 4])
def faces(request, random):
    """Triangles or quads over twelve vertices."""
    return np.array([random.permutation(12)[: request.param] for _ in range(20)])


def sides_of(faces):
    """Both ends of each side of faces (f,k), the lower one first, (f,k,2)."""
    return np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)


def test_numbers_are_those_of_the_edges(faces):
    edges = Edges(faces, 12)
    np.testing.assert_array_equal(np.stack([edges.low, edges.high], axis=-1)[edges.number], sides_of(faces))


def test_edges_are_counted_as_their_sorted_ends_are(faces):
    edges = Edges(faces, 12)
    expected, times = np.unique(sides_of(faces).reshape(-1, 2), axis=0, return_counts=True)
    np.testing.assert_array_equal(np.stack([edges.low, edges.high], axis=1), expected)
    np.testing.assert_array_equal(edges.count, times)
    every = np.indices((12, 12)).reshape(2, -1)
    known = {tuple(end): time for end, time in zip(expected.tolist(), times.tolist(), strict=True)}
    assert edges.faces_between(*every).tolist() == [known.get((min(a, b), max(a, b)), 0) for a, b in every.T.tolist()]


def test_both_faces_of_an_edge_have_its_ends_and_may_be_wound_alike(faces):
    edges = Edges(faces, 12)
    inner = np.flatnonzero(edges.count == 2)
    assert len(inner) == len(edges.alike) > 0
    for edge, one, other, alike in zip(inner, *edges.beside, edges.alike, strict=True):
        assert one != other
        ways = []
        for face in (one, other):
            at = int(np.flatnonzero(edges.number[face] == edge)[0])
            ways.append(faces[face][at] == edges.low[edge])
        assert alike == (ways[0] != ways[1])


def test_corners_at_ends_are_those_of_the_lower_and_the_higher_vertex(random):
    faces = np.array([random.permutation(12)[:3] for _ in range(20)])
    ends = faces.reshape(-1)[Edges(faces, 12).corners_at_ends(np.arange(60))]
    np.testing.assert_array_equal(ends.T.reshape(-1, 3, 2), sides_of(faces))


def test_ends_are_counted_at_vertices(faces):
    edges = Edges(faces, 12)
    for times in (1, 2):
        ends = np.append(edges.low[edges.count == times], edges.high[edges.count == times]).tolist()
        assert edges.ends_at(edges.count == times).tolist() == [ends.count(vertex) for vertex in range(12)]


def test_links_join_both_ends_of_every_edge_once(faces):
    edges = Edges(faces, 12)
    expected = np.zeros((12, 12))
    expected[edges.low, edges.high] = expected[edges.high, edges.low] = 1
    np.testing.assert_array_equal(edges.links().toarray(), expected)


def test_no_faces():
    edges = Edges(np.empty((0, 3), np.int32), 0)
    assert [len(x) for x in (edges.low, edges.high, edges.count, edges.number, *edges.beside, edges.alike)] == [0] * 7
    assert edges.faces_between(np.empty(0, int), np.empty(0, int)).shape == (0,)
