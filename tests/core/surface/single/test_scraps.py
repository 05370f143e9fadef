"""Sheets that meet, with scraps at their line."""

import numpy as np
import pytest

from core import Mesh
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.single.scraps import without_scraps
from tests import shapes

CELL, SIDE = 0.05, 8


@pytest.fixture(scope="module")
def surface():
    """Three squares that meet along the y axis."""
    points = shapes.junction(2000)
    normals = np.where((np.abs(points[:, 2]) < 1e-9)[:, None], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


def quads(corner):
    """Triangles of the squares between rows of vertices (m,n), (2(m-1)(n-1),3)."""
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])


def sheets():
    """A floor of 8 x 8 cells, and a wall of 4 x 8 on its middle line; the vertices of that line."""
    at = np.arange(SIDE + 1)
    floor = np.arange((SIDE + 1) ** 2).reshape(SIDE + 1, SIDE + 1)
    x = np.stack([*np.meshgrid(at - SIDE / 2, at - SIDE / 2, indexing="ij"), np.zeros(floor.shape)], -1).reshape(-1, 3)
    line = floor[SIDE // 2]
    up = floor.size + np.arange(4 * (SIDE + 1)).reshape(4, -1)
    wall = x[line] + np.arange(1, 5)[:, None, None] * np.array([0, 0, 1])
    vertices = CELL * np.concatenate([x, wall.reshape(-1, 3)])
    return Mesh(vertices, np.concatenate([quads(floor), quads(np.vstack([line, up]))]).astype(np.int32)), line


def with_more(mesh, points, faces):
    return Mesh(
        np.concatenate([mesh.vertices, CELL * np.reshape(points, (-1, 3))]), np.concatenate([mesh.faces, faces])
    )


def same(a, b):
    return sorted(map(sorted, a.vertices[a.faces].tolist())) == sorted(map(sorted, b.vertices[b.faces].tolist()))


def test_sheets_that_meet_have_none(surface):
    mesh, _ = sheets()
    assert without_scraps(mesh, surface, CELL) is mesh


def test_a_spur_below_the_floor_goes(surface):
    """As far down as the wall is past its line by a cell."""
    mesh, line = sheets()
    n = len(mesh.vertices)
    spur = with_more(mesh, [[0, 0, -1], [0, 1, -1]], quads(np.array([line[4:6], [n, n + 1]])))
    assert same(without_scraps(spur, surface, CELL), mesh)


@pytest.mark.parametrize("stays", [False, True])
def test_a_face_that_hangs_on_a_vertex_goes_and_one_by_itself_stays(surface, stays):
    mesh, line = sheets()
    n = len(mesh.vertices)
    points = [[0, 0, -1], [0, 1, -1], [0, 0.5, -0.1]]
    more = with_more(mesh, points, [[n + 2 if stays else line[4], n, n + 1]])
    assert same(without_scraps(more, surface, CELL), more if stays else mesh)


def test_a_flap_of_several_cells_stays(surface):
    mesh, line = sheets()
    n = len(mesh.vertices)
    down = n + np.arange(6).reshape(3, 2)
    points = [[0, y, -z] for z in (1, 2, 3) for y in (0, 1)]
    flap = with_more(mesh, points, quads(np.vstack([line[4:6], down])))
    assert without_scraps(flap, surface, CELL) is flap


@pytest.mark.parametrize("side", [1, -1])
def test_a_pocket_loses_the_patch_that_is_off_the_surface(surface, side):
    """A strut from the floor to the wall, closed at both ends: three faces more than the sheets."""
    mesh, line = sheets()
    floor, wall = line[4:6] + side * (SIDE + 1), (SIDE + 1) ** 2 + np.array([4, 5])
    strut = quads(np.array([floor, wall]))
    ends = np.array([[line[k], floor[k - 4], wall[k - 4]] for k in (4, 5)])
    assert same(without_scraps(with_more(mesh, [], np.concatenate([strut, ends])), surface, CELL), mesh)


def test_no_border_is_made(surface):
    """Of three patches with one rim two go, and the rest is as closed as before."""
    mesh, line = sheets()
    floor, wall = line[4:6] + SIDE + 1, (SIDE + 1) ** 2 + np.array([4, 5])
    ends = np.array([[line[k], floor[k - 4], wall[k - 4]] for k in (4, 5)])
    n = len(mesh.vertices)
    bulge = np.array([[floor[0], floor[1], n], [floor[1], wall[1], n], [wall[1], wall[0], n], [wall[0], floor[0], n]])
    strut = quads(np.array([floor, wall]))
    more = with_more(mesh, [[0.9, 0.5, 0.9]], np.concatenate([strut, ends, bulge]))
    assert same(without_scraps(more, surface, CELL), mesh)
