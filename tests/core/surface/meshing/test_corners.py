"""Corners between the sheets of a T: z = 0 and, on top of it, x = 0."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.meshing.corners import into_corners
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
    ],
    ids=["convex", "rim", "flat", "close", "far"],
)
def test_all_else_stays(columns, sides, junction):
    vertices, faces = strip(*columns)
    assert (cells_moved(vertices, faces, np.tile(sides, (ROWS, 1)), junction) == 0).all()


def test_sheets_that_end_before_their_planes_meet_stay_apart():
    far = np.stack(np.meshgrid(np.arange(3 * CELL, 1, 0.03), np.arange(-0.6, 0.6, 0.03)), axis=2).reshape(-1, 2)
    flat, upright = np.column_stack([far, 0 * far[:, 0]]), np.column_stack([0 * far[:, 0], far[:, ::-1]])
    points, normals = np.concatenate([flat, upright]), np.repeat([UP, RIGHT], len(far), axis=0)
    surface = fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 1.5)
    vertices, faces = strip((5, 0), (4, 0), (0, 4), (0, 5))
    assert (cells_moved(vertices, faces, np.tile([UP, UP, RIGHT, RIGHT], (ROWS, 1)), surface) == 0).all()


def test_where_planes_meet_off_the_surface_the_foot_of_that_place_is_taken(junction):
    vertices, faces = strip((2, 0), (1, 0), (0, 1), (0, 2))
    moved = into_corners(vertices, faces, np.tile([UP, *LEANING, RIGHT], (ROWS, 1)), junction, CELL)
    assert (moved != vertices).any(axis=1).sum() >= ROWS
    assert (junction.project(moved).distance <= 0.1 * CELL).all()


def test_between_sheets_that_bend_the_corner_is_found_where_they_meet():
    """Two cylinders around (-+.8, 0) that cross at (0, .6). Their tangent planes meet a cell off the surface."""
    turn, y = np.linspace(0, 2 * np.pi, 200, endpoint=False), np.arange(-0.6, 0.6, 0.03)
    circle = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    circles = [circle[x * (x + circle[:, 0]) > 0] + [x, 0, 0] for x in (-0.8, 0.8)]
    points = np.concatenate([np.add(ring, [0, each, 0]) for ring in circles for each in y])
    normals = points * [1, 0, 1] - np.where(points[:, :1] < 0, [-0.8, 0, 0], [0.8, 0, 0])
    surface = fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)

    z = np.array([0.95, 0.85, 0.85, 0.95])
    x = (0.8 - np.sqrt(1 - z**2)) * [-1, -1, 1, 1]
    vertices, faces = strip(*np.column_stack([x, z]) / CELL)
    side = np.tile(np.column_stack([x - 0.8 * np.sign(x), 0 * x, z]), (ROWS, 1))
    moved = into_corners(vertices, faces, side, surface, CELL).reshape(ROWS, 4, 3)
    lowest = moved[2:-2, np.abs(moved[2, :, 0]).argmin()]
    np.testing.assert_allclose(lowest[:, [0, 2]], np.tile([0, 0.6], (ROWS - 4, 1)), atol=0.25 * CELL)


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
