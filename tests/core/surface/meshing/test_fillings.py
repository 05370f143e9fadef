"""Triangulations of polygons: closed form, and every triangulation tried."""

import numpy as np
import pytest

from core.surface.meshing.fillings import fillings

NO_EDGES, NO_FACES = (np.empty((0, k), np.int64) for k in (2, 3))


def spanned(vertices, loop, edges=NO_EDGES, faces=NO_FACES):
    return fillings(vertices, [np.asarray(loop)], edges, faces, 1.0)[0]


def area(vertices, triangle):
    a, b, c = (vertices[triangle[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def every_triangulation(corners):
    """Of a polygon, as lists of triangles."""
    if len(corners) < 3:
        yield []
        return
    for k in range(1, len(corners) - 1):
        for left in every_triangulation(corners[: k + 1]):
            for right in every_triangulation(corners[k:]):
                yield [(corners[0], corners[k], corners[-1]), *left, *right]


def test_the_cheapest_of_all():
    rng = np.random.default_rng(0)
    for _ in range(10):
        x = rng.normal(size=(7, 3))

        def cost(triangles, x=x):
            t = np.array(triangles)
            squares = sum(((x[t[:, k]] - x[t[:, k - 1]]) ** 2).sum() for k in range(3))
            return area(x, t) + 0.1 * squares

        best = min(cost(triangles) for triangles in every_triangulation(list(range(7))))
        assert cost(spanned(x, range(7))) == pytest.approx(best)


def test_a_notched_polygon_is_filled_and_no_more():
    """An L of three unit squares, twelve corners."""
    x = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2], [0, 1]], float)
    x = np.column_stack([x, np.zeros(len(x))])
    found = spanned(x, range(8))
    assert len(found) == 6
    assert area(x, found) == pytest.approx(3)


def test_loops_of_several_sizes_keep_their_numbers():
    x = np.random.default_rng(1).normal(size=(12, 3))
    loops = [np.array([0, 1, 2, 3, 4]), np.array([5, 6, 7]), np.array([8, 9, 10, 11, 0])]
    triangle, loop = fillings(x, loops, NO_EDGES, NO_FACES, 1.0)
    for number, corners in enumerate(loops):
        assert (loop == number).sum() == len(corners) - 2
        assert set(triangle[loop == number].reshape(-1)) == set(corners)


def test_edges_and_faces_that_are_taken_are_passed_by():
    x = np.array([[0, 0, 0], [1, 0, 0], [1.1, 1.1, 0], [0, 1, 0]])
    short = set(map(frozenset, spanned(x, range(4)).tolist()))
    assert short == {frozenset({0, 1, 3}), frozenset({1, 2, 3})}
    long = {frozenset({0, 1, 2}), frozenset({0, 2, 3})}
    assert set(map(frozenset, spanned(x, range(4), edges=np.array([[3, 1]])).tolist())) == long
    assert set(map(frozenset, spanned(x, range(4), faces=np.array([[3, 1, 0]])).tolist())) == long
    assert len(spanned(x, range(4), faces=np.array([[0, 1, 2], [0, 1, 3]]))) == 0


def test_faces_are_told_apart_in_meshes_of_millions_of_vertices():
    """In one number of 64 bits for three vertices each, these two would be the same."""
    x = np.zeros((1 << 22, 3))
    loop = [1 << 20, 2_000_000, 3_000_000]
    x[loop] = np.eye(3)
    assert len(spanned(x, loop, faces=np.array([[0, 2_000_000, 3_000_000]]))) == 1
