"""Ridges of the distance between two planes, by closed form, and gaps that they keep open."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.blocks import SIDE, blocks_of, put, table_shape
from core.field.grid import Grid
from core.surface.double.ridges import raise_ridges
from tests import shapes
from tests.bands import near_band

GRID = Grid(np.full(3, -2.0), 0.25, (17, 17, 17))
NODE = np.arange(17**3)
TILTED = np.array([2.0, 1.0, 0.5]) / np.linalg.norm([2.0, 1.0, 0.5])


def between_planes(gap):
    """Nodes between two planes `gap` cells apart, the steps to them, and the distances at all nodes."""
    at, half = GRID.positions(NODE) @ TILTED + 0.04, 0.5 * gap * GRID.spacing
    away = np.abs(half - np.abs(at))
    inside = np.abs(at) < half
    step = np.sign(-at[inside])[:, None] * away[inside, None] * TILTED
    return near_band(GRID.shape, NODE[inside], step), away.reshape(GRID.shape).astype(np.float32)


def ends_of_crossing_edges():
    """(17,17,17) bool: nodes with a neighbour on the other side of the plane midway."""
    above = (GRID.positions(NODE) @ TILTED + 0.04 > 0).reshape(GRID.shape)
    ends = np.zeros(GRID.shape, bool)
    for axis in range(3):
        low, high = np.moveaxis(ends, axis, 0)[:-1], np.moveaxis(ends, axis, 0)[1:]
        crossed = np.diff(np.moveaxis(above, axis, 0), axis=0)
        low |= crossed
        high |= crossed
    return ends


@pytest.mark.parametrize("gap", [2.4, 3.0])
def test_nodes_beside_a_ridge_take_its_height_and_no_others_change(gap):
    band, before = between_planes(gap)
    values = before.copy()
    raise_ridges(values, band, GRID, GRID.spacing)
    raised = ends_of_crossing_edges() & (before > (np.sqrt(2) - 1) * GRID.spacing)
    np.testing.assert_allclose(values[raised], 0.5 * gap * GRID.spacing, rtol=1e-6)
    np.testing.assert_array_equal(values[~raised], before[~raised])


def test_ridges_too_low_for_the_level_stay():
    for gap, level in ((2.2, 1.0), (3.0, 0.5), (3.0, 1.6)):
        band, before = between_planes(gap)
        values = before.copy()
        raise_ridges(values, band, GRID, level * GRID.spacing)
        np.testing.assert_array_equal(values, before)


def test_errors_of_single_nodes_leave_no_pillars():
    band, before = between_planes(2.6)
    noise = np.random.default_rng(0).uniform(-0.25, 0.25, GRID.shape) * GRID.spacing
    values = np.maximum(before + noise, 0).astype(np.float32)
    safe = ends_of_crossing_edges() & (before > 0.7 * GRID.spacing)
    raise_ridges(values, band, GRID, GRID.spacing)
    assert (values[safe] > GRID.spacing).all()


def test_a_node_in_a_crack_stays():
    """As close to a sheet, and seen from it as much aslant, as none around it."""
    band, before = between_planes(2.6)
    at = (GRID.positions(band.node) @ TILTED + 0.04) / GRID.spacing
    below = np.flatnonzero((at > -0.8) & (at < -0.5))  # whose one neighbour above the ridge is the next along x
    middle = below[np.linalg.norm(GRID.positions(band.node[below]), axis=1).argmin()]
    aslant = 0.46 * GRID.spacing * np.array([0.3, 0.85, 0.43])
    values, step = before.copy(), band.step.copy()
    values.flat[band.node[middle]], step[middle] = np.linalg.norm(aslant), aslant
    raise_ridges(values, near_band(GRID.shape, band.node, step), GRID, GRID.spacing)
    assert values.flat[band.node[middle]] < 0.5 * GRID.spacing
    assert (values.flat[band.node[below[below != middle]]] > GRID.spacing).all()


def test_a_ridge_of_a_few_nodes_stays():
    """That over a crack in one sheet, for instance."""
    band, before = between_planes(2.6)
    near = np.linalg.norm(GRID.positions(band.node), axis=1) < 1.2 * GRID.spacing
    values = before.copy()
    raise_ridges(values, near_band(GRID.shape, band.node[near], band.step[near]), GRID, GRID.spacing)
    np.testing.assert_array_equal(values, before)
    assert near.sum() > 4


def test_wide_wedges_stay():
    """Two half-planes at a right angle, as inside a cube."""
    frame = shapes.random_rotation(0)
    at = GRID.positions(NODE) @ frame
    wall = np.abs(at[:, :2]).argmin(axis=1)
    step = np.where(np.arange(3) == wall[:, None], at, 0.0) @ frame.T
    inside = (at[:, :2] > 0).all(axis=1)
    before = np.linalg.norm(step, axis=1).reshape(GRID.shape).astype(np.float32)
    values = before.copy()
    raise_ridges(values, near_band(GRID.shape, NODE[inside], step[inside]), GRID, GRID.spacing)
    np.testing.assert_array_equal(values, before)


def test_the_sides_of_the_box_are_no_neighbours():
    """Nodes at its far sides are followed, in a flattened array, by those at its near ones."""
    at = GRID.positions(NODE)
    side = np.abs(at).max(axis=1) == 2.0
    step = 1.3 * GRID.spacing * at / np.linalg.norm(at, axis=1, keepdims=True).clip(1e-9)
    before = np.full(GRID.shape, GRID.spacing, np.float32)
    values = before.copy()
    raise_ridges(values, near_band(GRID.shape, NODE[side], step[side]), GRID, GRID.spacing)
    np.testing.assert_array_equal(values, before)


def test_blocks_take_the_same_values():
    band, values = between_planes(3.0)
    blocks = blocks_of(GRID.shape, np.arange(np.prod(table_shape(GRID.shape))), np.float32(0))
    put(blocks, NODE, values.reshape(-1))
    raise_ridges(values, band, GRID, GRID.spacing)
    raise_ridges(blocks, band, GRID, GRID.spacing)
    assert blocks.stored.shape[1:] == (SIDE,) * 3
    np.testing.assert_array_equal(blocks.dense(), values)


@pytest.mark.usefixtures("at_offset")
@pytest.mark.parametrize("gap", [2.4, 2.7])
def test_spheres_in_each_other_stay_two(gap):
    """Little more than two levels apart: each has an outer and an inner layer."""
    cell = 2.5 / 48
    points = np.concatenate([shapes.sphere(4000), shapes.sphere(3000, 1 - gap * cell)])
    run = reconstruct(points, Settings(resolution=48))
    assert run.field.spacing == pytest.approx(cell, rel=0.01)
    assert [shapes.euler(piece) for piece in shapes.components(run.surface)] == [2] * 4
