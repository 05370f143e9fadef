"""Pinholes of open sheets, on exact iso-surfaces around squares with a round hole, and in whole runs."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.grid import Grid
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.double import double_cover
from core.surface.double.pinholes import _loops, find_pinholes
from core.surface.meshing.isosurface import isosurface
from tests import shapes

GRID = Grid(np.array([-1.31, -1.31, -0.32]), 0.05, (53, 53, 14))
LEVEL = 1.1 * GRID.spacing
SPACING = 0.08


def foot_points(x, holes):
    """Of places (m,3), on the square of side 2 in the plane z = 0 without holes, (centre, radius) each, far apart; and
    whether they are on rims."""
    foot = np.column_stack([np.clip(x[:, :2], -1, 1), np.zeros(len(x))])
    past_rim = (np.abs(x[:, :2]) > 1).any(axis=1)
    for centre, radius in holes:
        way = foot[:, :2] - centre
        away = np.linalg.norm(way, axis=1)
        within = away < radius
        foot[within, :2] = centre + radius * (way / np.maximum(away, 1e-9)[:, None])[within]
        past_rim |= within
    return foot, past_rim


def iso_surface(grid, foot):
    """Vertices and faces of that around the surface onto which a function takes places (m,3)."""
    node = grid.positions(np.arange(np.prod(grid.shape)))
    away = np.linalg.norm(node - foot(node), axis=1).astype(np.float32)
    cells, faces = isosurface(away.reshape(grid.shape), LEVEL)
    return grid.origin + grid.spacing * cells, faces


def found_around(holes, bridge=3.0):
    """Pinholes of the exact iso-surface around that square, whose samples lie a spacing off the rims of its holes."""
    vertices, faces = iso_surface(GRID, lambda x: foot_points(x, holes)[0])
    foot, past_rim = foot_points(vertices, holes)
    points = shapes.square(int(4 / SPACING**2))
    for centre, radius in holes:
        points = points[np.linalg.norm(points[:, :2] - centre, axis=1) > radius]
    return find_pinholes(vertices, faces, vertices - foot, past_rim, surface_of(points, bridge), GRID), vertices, faces


def surface_of(points, bridge=3.0):
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return fit_local_surface(points, up, np.ones(len(points)), local_spacing(points), bridge)


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.51, -0.38)])
def test_a_pinhole_is_filled_from_rim_to_rim(centre):
    places, *_ = found_around([(centre, 0.12)], bridge=6.0)
    away = np.linalg.norm(places[:, :2] - centre, axis=1)
    np.testing.assert_allclose(places[:, 2], 0, atol=0.5 * GRID.spacing)
    assert away.min() < 0.2 * GRID.spacing
    assert 0.12 - LEVEL - 0.5 * GRID.spacing < away.max() < 0.12
    filled = np.linalg.norm(places[:, None] - places, axis=2) + 9 * np.eye(len(places))
    assert filled.min(axis=1).max() < 0.7 * GRID.spacing


def test_each_of_several_is_filled():
    holes = [((0.5, 0.5), 0.1), ((-0.5, 0.4), 0.13), ((0.1, -0.5), 0.16)]
    places, *_ = found_around(holes, bridge=6.0)
    for centre, radius in holes:
        assert (np.linalg.norm(places[:, :2] - centre, axis=1) < radius).sum() > 5


@pytest.mark.parametrize(("bridge", "found"), [(3.0, False), (9.0, True)])
def test_wider_openings_than_are_bridged_stay(bridge, found):
    assert (len(found_around([((0, 0), 0.3)], bridge)[0]) > 0) == found


def test_a_sheet_without_holes_has_none_although_its_rim_turns():
    assert len(found_around([], bridge=20.0)[0]) == 0


def test_the_mouth_of_a_tube_is_none():
    grid = Grid(np.array([-0.51, -0.51, -1.91]), 0.05, (21, 21, 77))

    def foot(x):
        around = x[:, :2] / np.maximum(np.linalg.norm(x[:, :2], axis=1), 1e-9)[:, None]
        return np.column_stack([0.2 * around, np.clip(x[:, 2], -1.5, 1.5)])

    vertices, faces = iso_surface(grid, foot)
    points = shapes.cylinder(600) * [0.2, 0.2, 1.5]
    radial = points / 0.2 * [1, 1, 0]
    surface = fit_local_surface(points, radial, np.ones(len(points)), local_spacing(points), 9.0)
    past_rim = np.abs(vertices[:, 2]) > 1.5
    assert len(find_pinholes(vertices, faces, vertices - foot(vertices), past_rim, surface, grid)) == 0


def test_the_rim_of_a_small_sheet_is_none():
    """A square four cells wide has as much iso-surface on either side as there is."""
    points = 0.1 * shapes.square(400)

    def foot(x):
        return np.column_stack([np.clip(x[:, :2], -0.1, 0.1), np.zeros(len(x))])

    vertices, faces = iso_surface(GRID, foot)
    step = vertices - foot(vertices)
    past_rim = (np.abs(vertices[:, :2]) > 0.1).any(axis=1)
    assert len(find_pinholes(vertices, faces, step, past_rim, surface_of(points, 20.0), GRID)) == 0


def test_faces_that_turn_one_after_the_other_are_no_loop_unless_they_come_back():
    """A ring of eight quads around a tube, and the same without one of them."""
    around = np.arange(8)
    ring = np.stack([around, (around + 1) % 8, (around + 1) % 8 + 8, around + 8], axis=1)
    turning = np.tile([False, True, False, True], (8, 1))
    assert [sorted(loop) for loop in _loops(ring, turning)] == [list(range(8))]
    turning[3, 1] = turning[4, 3] = False
    assert _loops(ring, turning) == []


def test_a_speck_seen_from_the_other_side_is_none():
    """Few vertices on one side of a sheet whose steps point to the other, as they may at creases."""
    holes = [((0.5, 0.5), 0.12)]
    places, vertices, faces = found_around(holes, bridge=6.0)
    foot, past_rim = foot_points(vertices, holes)
    step = vertices - foot
    step[(vertices[:, 2] > 0) & (np.linalg.norm(vertices[:, :2] + 0.5, axis=1) < 2.5 * GRID.spacing)] *= -1
    points = shapes.square(int(4 / SPACING**2))
    points = points[np.linalg.norm(points[:, :2] - 0.5, axis=1) > 0.12]
    np.testing.assert_array_equal(find_pinholes(vertices, faces, step, past_rim, surface_of(points, 6.0), GRID), places)


def from_holes(points):
    return np.linalg.norm(points[:, None, :2] - [[-0.4, 0.2], [0.5, -0.4], [0.3, 0.5]], axis=2).min(axis=1)


def wave(x):
    return 0.2 * np.sin(2 * x)


def pierced(seed, radius):
    """1,500 random points of a wave but those within so many spacings of three places."""
    points = np.random.default_rng(seed).uniform(-1, 1, (1500, 3))
    points[:, 2] = wave(points[:, 0])
    return points[from_holes(points) > radius * np.median(local_spacing(points))]


@pytest.mark.usefixtures("at_offset")
@pytest.mark.parametrize("band", [None, 3.0])
@pytest.mark.parametrize(("seed", "off"), [(0, 0.001), (3, 0.004)])
def test_runs_span_pinholes_smoothly_and_leave_wide_holes(seed, off, band):
    """Without this each has one. Folded onto its rim, the first would be four times as far off."""
    cover = reconstruct(pierced(seed, 2.2), Settings(resolution=64, band=band)).surface
    assert len(shapes.components(cover)) == 1
    assert shapes.euler(cover) == 2
    vertices = cover.vertices[from_holes(cover.vertices) < 0.15]
    assert np.abs(vertices[:, 2] - wave(vertices[:, 0])).max() < off
    assert shapes.euler(reconstruct(pierced(seed, 4.0), Settings(resolution=64, band=band)).surface) == -4


@pytest.mark.usefixtures("at_offset")
def test_once_they_are_filled_only_new_vertices_look_for_the_surface_again(monkeypatch):
    asked, look = [], double_cover.first_steps
    monkeypatch.setattr(double_cover, "first_steps", lambda x, *rest: asked.append(len(x)) or look(x, *rest))
    vertices = reconstruct(pierced(0, 2.2), Settings(resolution=64)).surface.vertices
    every, new = asked
    assert 0 < new < every / 10
    monkeypatch.setattr(double_cover, "_shared", lambda *_: (np.empty(0, int), np.empty(0, int)))
    np.testing.assert_array_equal(reconstruct(pierced(0, 2.2), Settings(resolution=64)).surface.vertices, vertices)
    assert asked[3] > every / 2
