"""Corners between the sheets of a T: z = 0 and, on top of it, x = 0."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.corners import into_corners
from tests import shapes

CELL = 0.05
ROWS = 12
UP, RIGHT = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
LEANING = np.array([0.4, 0, 1]) / np.hypot(0.4, 1), np.array([1, 0, 0.4]) / np.hypot(1, 0.4)


@pytest.fixture(scope="module")
def junction():
    points = shapes.junction(6000)
    upright = np.abs(points[:, 2]) > 0
    normals = np.where(upright[:, None], RIGHT, UP)
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


def strip(*columns):
    """Quads between columns of vertices (x, z), in cells, that are repeated along y."""
    y = np.linspace(-0.3, 0.3, ROWS)
    vertices = np.array([[x * CELL, each, z * CELL] for each in y for x, z in columns])
    number = np.arange(len(vertices)).reshape(ROWS, -1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=2).reshape(-1, 4)
    return vertices, quads


def cells_moved(vertices, faces, side, junction):
    """Moves in x and z, (rows,columns,2) in cells."""
    before = vertices.copy()
    moved = into_corners(vertices, faces, side, junction, CELL)
    np.testing.assert_array_equal(vertices, before)
    return ((moved - before)[:, [0, 2]] / CELL).reshape(ROWS, -1, 2)


def test_of_two_vertices_beside_a_corner_the_closer_one_goes_there(junction):
    vertices, faces = strip((3, 0), (2, 0), (1.2, 0), (0, 0.9), (0, 2))
    side = np.tile([UP, UP, UP, RIGHT, RIGHT], (ROWS, 1))
    moved = cells_moved(vertices, faces, side, junction)
    np.testing.assert_allclose(moved[:, 3], np.tile([0, -0.9], (ROWS, 1)), atol=0.05)
    assert (moved[:, [0, 1, 2, 4]] == 0).all()


def test_quads_split_in_two_do_the_same(junction):
    vertices, quads = strip((2, 0), (0.9, 0), (0, 1.2), (0, 2))
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    side = np.tile([UP, UP, RIGHT, RIGHT], (ROWS, 1))
    moved = cells_moved(vertices, halves, side, junction)
    np.testing.assert_allclose(moved[:, 1], np.tile([-0.9, 0], (ROWS, 1)), atol=0.05)
    assert (moved[:, [0, 2, 3]] == 0).all()


@pytest.mark.parametrize(
    ("columns", "sides"),
    [
        ([(2, 0), (1, 0), (0, 1), (0, 2)], [-UP, -UP, -RIGHT, -RIGHT]),  # from outside: convex
        ([(2, 0), (1, 0), (0, 1), (0, 2)], [UP, 0 * UP, RIGHT, RIGHT]),  # past a rim
        ([(4, 0), (3, 0), (2, 0), (1, 0)], [UP, UP, UP, UP]),  # flat
        ([(4, 0), (3, 0), (3, 1.5), (4, 1.5)], [UP, UP, -UP, -UP]),  # between sheets side by side
        ([(12, 0), (11, 0), (0, 11), (0, 12)], [UP, UP, RIGHT, RIGHT]),  # far away
        ([(5, 0), (4, 0), (0, 4), (0, 5)], [UP, *LEANING, RIGHT]),  # planes that meet far off the sheets
    ],
    ids=["convex", "rim", "flat", "close", "far", "off"],
)
def test_all_else_stays(columns, sides, junction):
    vertices, faces = strip(*columns)
    assert (cells_moved(vertices, faces, np.tile(sides, (ROWS, 1)), junction) == 0).all()


def test_where_planes_meet_off_the_surface_the_foot_of_that_place_is_taken(junction):
    vertices, faces = strip((2, 0), (1, 0), (0, 1), (0, 2))
    moved = into_corners(vertices, faces, np.tile([UP, *LEANING, RIGHT], (ROWS, 1)), junction, CELL)
    assert (moved != vertices).any(axis=1).sum() >= ROWS
    assert (junction.project(moved).distance <= 0.1 * CELL).all()


def test_the_cover_reaches_into_the_corners_of_a_junction():
    run = reconstruct(shapes.junction(4000), Settings(resolution=64))
    cell = run.report["grid"]["cell"]
    closest = run.surface.vertices[run.surface.faces].reshape(-1, 3)
    inside = np.abs(closest[:, 1]) < 0.8
    for x in (-1, 1):
        beside = closest[inside & (x * closest[:, 0] > -0.01 * cell) & (closest[:, 2] > -0.01 * cell)]
        off = np.abs(beside[:, 0]) + np.abs(beside[:, 2])
        rows = np.floor(beside[:, 1] / (2 * cell)).astype(int)
        nearest = np.full(np.ptp(rows) + 1, np.inf)
        np.minimum.at(nearest, rows - rows.min(), off / cell)
        assert np.percentile(nearest, 90) < 0.3
