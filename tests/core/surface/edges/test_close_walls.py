"""Sheets side by side against exact bands: steps of closed-form shapes among dense samples."""

import numpy as np
import pytest

from core.field.grid import Grid
from core.field.integration import BAND
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.edges.close_walls import beside_within_cells
from tests import shapes
from tests.bands import near_band

GRID = Grid(np.full(3, -1.51), 0.1, (31, 31, 31))
TURN = shapes.random_rotation(3)


def band_and_surface(points, normals, foot, at_rims=False):
    """Of a shape of which `foot` gives the foot points (m,3) of positions (m,3)."""
    surface = fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)
    every = np.arange(np.prod(GRID.shape))
    at = GRID.positions(every)
    step = at - foot(at)
    near = np.linalg.norm(step, axis=1) <= BAND * GRID.spacing
    past_rim = np.full(near.sum(), at_rims)
    return near_band(GRID.shape, every[near], step[near], past_rim, surface.tree.query(at[near])[1]), surface


def planes(heights, count=3000, **settings):
    """Turned squares of side 2 at some heights, continued past their rims."""
    flat = np.random.default_rng(0).uniform(-1, 1, (len(heights) * count, 2))
    points = np.column_stack([flat, np.repeat(heights, count)]) @ TURN.T

    def foot(x):
        x, levels = x @ TURN, np.array(heights)
        z = levels[np.abs(x[:, 2:] - levels).argmin(axis=1)]
        return np.column_stack([x[:, :2], z]) @ TURN.T

    return band_and_surface(points, np.tile(TURN[:, 2], (len(points), 1)), foot, **settings)


@pytest.mark.parametrize("cells", [0.6, 1.0, 1.4, 1.9])
def test_planes_within_two_cells_are_found(cells):
    assert beside_within_cells(*planes([-0.05 * cells, 0.05 * cells]), GRID).mean() > 0.99


@pytest.mark.parametrize("heights", [[0.0], [-0.155, 0.155]])
def test_one_plane_or_two_that_are_farther_apart_are_not(heights):
    assert not beside_within_cells(*planes(heights), GRID).any()


@pytest.mark.parametrize("settings", [{"count": 150}, {"at_rims": True}])
def test_neither_are_sparse_samples_nor_feet_at_rims(settings):
    assert not beside_within_cells(*planes([-0.05, 0.05], **settings), GRID).any()


@pytest.mark.parametrize("radius", [0.4, 1.0])
def test_a_bend_is_one_sheet(radius):
    sphere = shapes.sphere(6000)
    foot = lambda x: radius * x / np.linalg.norm(x, axis=1, keepdims=True)  # noqa: E731
    assert not beside_within_cells(*band_and_surface(radius * sphere, sphere, foot), GRID).any()


def test_only_samples_close_by_are_marked():
    """A second plane above one half of the first."""
    band, surface = planes([-0.06, 0.06])
    upper = surface.points @ TURN
    one = band.step @ TURN
    lone = (GRID.positions(band.node) @ TURN)[:, 0] > 0
    one[lone, 2] = (GRID.positions(band.node) @ TURN)[lone, 2] + 0.06
    half = near_band(GRID.shape, band.node, one @ TURN.T, sample=band.sample)
    marked = beside_within_cells(half, surface, GRID)
    assert marked[upper[:, 0] < -0.2].all()
    assert not marked[upper[:, 0] > 0.3].any()
