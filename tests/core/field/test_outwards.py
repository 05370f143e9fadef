"""Distances carried outwards are those to the nearest foot of all, but for ties."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from core.field.blocks import SIDE, blocks_of, table_shape
from core.field.feet import Feet
from core.field.grid import Grid
from core.field.groups import HALF, groups_near
from core.field.local_surface import fit_local_surface
from core.field.outwards import carried_outwards
from core.points import local_spacing
from core.progress import Progress
from tests import shapes

GRID, WIDTH = Grid(np.full(3, -1.45), 0.07, (42, 41, 43)), 5.0
CELL = GRID.spacing


@pytest.fixture(scope="module")
def ball():
    points = shapes.sphere(2000)
    return fit_local_surface(points, points, np.ones(len(points)), local_spacing(points), 3.0)


@pytest.fixture(scope="module")
def no_sample(ball):
    """Its samples lie where none is close to any node."""
    return replace(ball, points=ball.points + 9)


@pytest.fixture(scope="module")
def groups(ball):
    return groups_near(ball, GRID, WIDTH, Progress())


def feet_of(points, radius=0.0):
    return Feet(*np.float32([(points - GRID.origin).T, points.T]), np.full(len(points), radius, np.float32))


def nothing_known(groups):
    block = np.unique(np.ravel_multi_index(tuple((groups.corner // SIDE).T), table_shape(GRID.shape)))
    return blocks_of(GRID.shape, block, np.float32(WIDTH * CELL))


def test_groups_hold_all_nodes_of_the_band_once(groups):
    parts = [groups.members(octant) for octant in np.indices((2, 2, 2)).reshape(3, 8).T]
    node = np.concatenate([part for part, _ in parts])
    assert len(np.unique(node)) == len(node)
    every = np.arange(np.prod(GRID.shape))
    near = shapes.sphere_distance(GRID.positions(every)) <= WIDTH * CELL
    assert np.isin(every[near], node).all()
    assert len(node) < 0.9 * len(every)
    for part, group in parts:
        assert (np.diff(group) > 0).all()
        off = np.abs(GRID.positions(part) - groups.middles[group])
        np.testing.assert_allclose(off, 0.5 * CELL, atol=1e-9)
    np.testing.assert_array_equal(groups.sample, KDTree(shapes.sphere(2000)).query(groups.middles)[1])


def test_the_groups_make_a_grid_of_their_own(groups):
    lattice = groups.lattice()
    assert lattice.shape == (21, 21, 22)
    assert (np.diff(lattice.node) > 0).all()
    here, there = lattice.edges(1)
    np.testing.assert_array_equal(groups.corner[there] - groups.corner[here], np.tile([0, 2, 0], (len(here), 1)))


@pytest.mark.parametrize("count", [3, 6000])
def test_distances_are_those_to_the_nearest_foot_of_all(no_sample, groups, count):
    """Feet as dense as those of a run, and a few."""
    feet = feet_of(shapes.sphere(count))
    values = nothing_known(groups)
    carried_outwards(values, groups, feet, no_sample, WIDTH, Progress())
    x = GRID.positions(np.arange(np.prod(GRID.shape)))
    expected = np.minimum(KDTree(feet.centres.T).query(x - GRID.origin)[0], WIDTH * CELL)
    off = np.abs(values.dense().reshape(-1) - expected) / CELL
    assert np.mean(off > 1e-4) < 0.01
    assert off.max() < 0.3


def test_a_foot_stands_for_a_disc(no_sample, groups):
    points = shapes.sphere(1500)
    found = [nothing_known(groups) for _ in range(2)]
    for values, radius in zip(found, (0.0, 0.6 * CELL), strict=True):
        carried_outwards(values, groups, feet_of(points, radius), no_sample, WIDTH, Progress())
    x = GRID.positions(np.arange(np.prod(GRID.shape)))
    expected = np.minimum(shapes.sphere_distance(x), WIDTH * CELL)
    to_points, to_discs = (np.abs(values.dense().reshape(-1) - expected).mean() / CELL for values in found)
    assert to_discs < 0.01
    assert to_discs < 0.2 * to_points


def test_known_distances_stay(ball, groups):
    values = nothing_known(groups)
    node = groups.members(np.array([0, 1, 0]))[0]
    values.put(node, np.float32(0.123))
    carried_outwards(values, groups, feet_of(shapes.sphere(6000)), ball, WIDTH, Progress())
    assert (values.at(node) == np.float32(0.123)).all()
    assert (values.at(groups.members(np.array([0, 0, 0]))[0]) != np.float32(0.123)).all()


def test_without_feet_samples_are_the_surface(ball, groups):
    values = nothing_known(groups)
    carried_outwards(values, groups, feet_of(np.empty((0, 3))), ball, WIDTH, Progress())
    x = GRID.positions(np.arange(np.prod(GRID.shape)))
    expected = np.minimum(KDTree(ball.points).query(x)[0], WIDTH * CELL)
    off = (values.dense().reshape(-1) - expected) / CELL
    assert off.min() > -1e-4
    assert off.mean() < 0.1
    assert off.max() < 2 * HALF
