"""Walls that no node of the grid lies in, beside open sheets."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.single import thin_walls
from tests import shapes

WALL = 0.025


def run(points, **settings):
    return reconstruct(points, Settings(resolution=40, surface="both", **settings))


def tube_and_disc():
    """A tube with walls of .46 cells, and a disc over it."""
    return np.concatenate([shapes.scattered_tube(12_000, WALL), 0.5 * shapes.disc(1500) + [0, 0, 1.5]])


@pytest.fixture(scope="module")
def beside_disc():
    return run(tube_and_disc())


def test_a_wall_shows_both_its_sheets_once_and_an_open_sheet_one_layer(beside_disc):
    assert WALL / beside_disc.report["grid"]["cell"] < 0.5
    wall, sheet = shapes.components(beside_disc.sheet)
    assert (shapes.euler(wall), wall.border_loops()) == (0, 0)
    assert (shapes.euler(sheet), sheet.border_loops()) == (1, 1)
    assert beside_disc.report["warnings"] == []


def test_a_wall_is_as_thick_as_it_is_and_wound_outwards(beside_disc):
    wall = shapes.components(beside_disc.sheet)[0]
    assert shapes.signed_volume(wall) == pytest.approx(np.pi * (0.5**2 - (0.5 - WALL) ** 2), rel=0.02)


def test_a_ball_pressed_flat_is_one_wall():
    """It is .8 cells thick."""
    found = run(shapes.scattered_sphere(4000) * [1, 1, 0.02] @ shapes.random_rotation(4).T, denoise=0)
    np.testing.assert_array_equal(found.sheet.vertices, found.surface.vertices)
    assert shapes.euler(found.sheet) == 2
    assert found.report["warnings"] == []


def test_quads_stay_quads():
    sheet = run(shapes.scattered_tube(12_000, WALL), faces="quads").sheet
    assert sheet.pairs > 0.4 * len(sheet.faces)
    np.testing.assert_array_equal(sheet.faces[: sheet.pairs, 0], sheet.faces[sheet.pairs : 2 * sheet.pairs, 0])
    assert shapes.euler(sheet) == 0


def test_what_is_no_closer_stays(monkeypatch):
    chamfer = thin_walls.chamfer
    monkeypatch.setattr(thin_walls, "chamfer", lambda *given: -chamfer(*given))
    assert shapes.euler(shapes.components(run(tube_and_disc()).sheet)[0]) < 0


@pytest.mark.parametrize("shape", [shapes.disc, shapes.hemisphere])
def test_both_sides_of_an_open_sheet_are_no_wall(shape, monkeypatch):
    points = shape(1500)
    found = run(points)
    surface = fit_local_surface(points, found.normals, found.confidence, local_spacing(points), 3.0)
    monkeypatch.setattr(thin_walls, "chamfer", lambda *given: pytest.fail("asked which is closer"))
    same, unoriented = thin_walls.with_thin_walls(found.sheet, 3, found.surface, surface, found.field.spacing)
    assert same is found.sheet
    assert unoriented == 3
    nothing = found.surface.part(np.zeros(len(found.surface.faces), bool))
    assert thin_walls.with_thin_walls(found.sheet, 3, nothing, surface, found.field.spacing)[0] is found.sheet
