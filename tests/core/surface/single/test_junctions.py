"""Vertices where the sheets of a T meet: z = 0 and, on top of it, x = 0. Places in x and z are in cells."""

import numpy as np
import pytest

from core import Mesh
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.single.junctions import onto_junctions
from tests import shapes

CELL = 0.05
ROWS = 12
LINE = slice(0, ROWS)
UP, RIGHT = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])


def surface_of(points, normals):
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


@pytest.fixture(scope="module", params=[6000, 40000], ids=["sparse", "dense"])
def junction(request):
    points = shapes.junction(request.param)
    return surface_of(points, np.where((np.abs(points[:, 2]) > 0)[:, None], RIGHT, UP))


def fan(line, *strips):
    """Strips of quads, split in two, through columns of places (x, z) that lead away from a line parallel to y, at the
    place `line`, which is the first ROWS vertices."""
    y, columns = np.linspace(-0.3, 0.3, ROWS), [line, *(place for strip in strips for place in strip)]
    vertices = np.array([[x * CELL, each, z * CELL] for x, z in columns for each in y])
    number, quads, start = np.arange(len(vertices)).reshape(-1, ROWS), [], 1
    for strip in strips:
        rows = number[[0, *range(start, start + len(strip))]]
        quads.append(np.stack([rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]], axis=2).reshape(-1, 4))
        start += len(strip)
    quads = np.concatenate(quads)
    return Mesh(vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32))


def ray(x, z):
    """Four places a step (x, z) apart, from the origin on."""
    return [(k * x, k * z) for k in (1, 2, 3, 4)]


def tee(line):
    return fan(line, ray(1, 0), ray(-1, 0), ray(0, 1))


@pytest.mark.parametrize("place", [(0.7, 0), (-0.9, 0), (0, 0.8), (0, 0)])
def test_they_go_to_the_line_along_which_sheets_meet_and_others_stay(place, junction):
    mesh = tee(place)
    before = mesh.vertices.copy()
    found = onto_junctions(mesh, junction, CELL)
    assert np.abs(found.vertices[LINE, [[0], [2]]]).max() < 0.03 * CELL
    np.testing.assert_allclose(found.vertices[LINE, 1], before[LINE, 1], atol=0.03 * CELL)
    np.testing.assert_array_equal(found.vertices[ROWS:], before[ROWS:])
    np.testing.assert_array_equal(found.faces, mesh.faces)
    np.testing.assert_array_equal(mesh.vertices, before)


def test_sheets_are_known_that_only_vertices_three_edges_away_lie_on(junction):
    """As where faces cut the corner between them."""
    wall = [(1.2, 0), (1.5, 0), (0, 3), (0, 4)]
    found = onto_junctions(fan((0.9, 0), ray(-1, 0), [(2, 0), (3, 0)], wall), junction, CELL)
    assert np.abs(found.vertices[LINE, [[0], [2]]]).max() < 0.03 * CELL


def test_a_sheet_alone_stays_as_it_is(junction):
    mesh = fan((0.7, 0), ray(1, 0), ray(-1, 0))
    assert onto_junctions(mesh, junction, CELL) is mesh


def test_where_sheets_run_side_by_side_vertices_stay():
    """Two planes at 20 degrees to each other, which tell the line too loosely."""
    flat, slope = shapes.square(3000), np.tan(np.radians(20))
    tilted = flat[:, [1, 0, 2]] + flat[:, [1]] * [0, 0, slope]
    leaning = np.array([-slope, 0, 1]) / np.hypot(slope, 1)
    surface = surface_of(np.concatenate([flat, tilted]), np.repeat([UP, leaning], len(flat), axis=0))
    mesh = fan((0.7, 0), ray(1, 0), ray(-1, 0), ray(1, slope))
    np.testing.assert_array_equal(onto_junctions(mesh, surface, CELL).vertices, mesh.vertices)


def test_vertices_far_from_the_line_stay(junction):
    mesh = tee((1.4, 0))
    np.testing.assert_array_equal(onto_junctions(mesh, junction, CELL).vertices, mesh.vertices)


def test_where_planes_meet_at_a_corner_three_lines_end_there():
    """Of the planes x = 0, y = 0 and z = 0, the vertex half a cell off in every direction."""
    flat = shapes.square(4000)
    points = np.concatenate([np.roll(flat, axis, axis=1) + 1e-4 * axis * np.ones(3) for axis in range(3)])
    surface = surface_of(points, np.repeat(np.eye(3)[[2, 0, 1]], len(flat), axis=0))
    tips = CELL * np.concatenate([np.eye(3), -np.eye(3)])
    vertices = np.concatenate([[[0.5 * CELL, 0.5 * CELL, 0]], tips])
    wings = [(a, b) for a in range(6) for b in range(a + 1, 6) if a % 3 != b % 3]
    faces = np.array([(0, 1 + a, 1 + b) for a, b in wings], np.int32)
    found = onto_junctions(Mesh(vertices, faces), surface, CELL)
    assert np.linalg.norm(found.vertices[0]) < 0.05 * CELL
