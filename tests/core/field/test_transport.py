"""The distance carried outwards: which foot each node takes, against all of them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from core.field.feet import Feet, settled_feet
from core.field.grid import Grid, fit_grid
from core.field.integration import near_band
from core.field.local_surface import fit_local_surface
from core.field.projection import FROM_NODES
from core.field.transport import _close_feet, _Held, transport
from core.points import local_spacing
from core.progress import Progress
from tests import shapes


def seeded(points, normals, resolution):
    """A grid from the origin, its nodes that have feet on the surface of samples with these normals, and the feet."""
    surface = fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)
    grid = fit_grid(points, resolution)
    node = near_band(surface, grid).node
    projected = surface.project(grid.positions(node), nearest=FROM_NODES)
    return replace(grid, origin=np.zeros(3)), *settled_feet(surface, grid, node, projected, Progress())


@pytest.fixture(scope="module")
def sphere():
    points = shapes.sphere(800)
    return seeded(points, points, 50)


@pytest.fixture(scope="module")
def sheets():
    points = shapes.sheets(1500, 0.3)
    return seeded(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)), 41)


@pytest.fixture(scope="module")
def scattered():
    """Nodes here and there, each with a foot of its own within half a cell: none beside another to climb to."""
    random = np.random.default_rng(0)
    grid = Grid(np.zeros(3), 0.25, (41, 36, 33))
    node = np.sort(random.choice(np.prod(grid.shape), 300, replace=False))
    places = (grid.positions(node) + 0.125 * random.uniform(-1, 1, (300, 3))).T.astype(np.float32)
    return grid, node, Feet(places, np.tile(np.float32([[0], [0], [1]]), 300), np.zeros(300, np.float32))


@pytest.mark.parametrize(
    ("seeds", "mean", "nearly_all", "largest"),
    [("sphere", 0.02, 0.15, 0.6), ("sheets", 0.01, 0.15, 0.4), ("scattered", 0.004, 0.1, 2.0)],
)
def test_every_node_takes_a_foot_hardly_farther_than_the_nearest(seeds, mean, nearly_all, largest, request):
    grid, node, feet = request.getfixturevalue(seeds)
    x = grid.positions(np.arange(np.prod(grid.shape)))
    taken = np.linalg.norm(x - feet.centres.T[_close_feet(grid, node, feet, Progress()).ravel()], axis=1)
    more = (taken - KDTree(feet.centres.T).query(x)[0]) / grid.spacing
    assert more.min() > -1e-3
    assert more.mean() < mean
    assert np.percentile(more, 99) < nearly_all
    assert more.max() < largest


def test_the_distance_is_that_to_the_disc_of_this_foot(sphere):
    grid, node, feet = sphere
    x = np.ascontiguousarray(grid.positions(np.arange(np.prod(grid.shape))).T, np.float32)
    values, _ = transport(grid, node, feet)
    assert (values.shape, values.dtype) == (grid.shape, np.float32)
    row = _close_feet(grid, node, feet, Progress())
    np.testing.assert_allclose(values.ravel(), feet.distance(x, row.ravel()), atol=1e-6)


def test_nodes_take_the_closest_foot_of_their_own_and_their_neighbours(random):
    """Against the distances to all seven, at the sides of the box, too, and in slabs of any thickness."""
    shape, feet = (5, 4, 6), 40
    grid = Grid(np.array([-0.3, 0.1, 0.7]), 0.25, shape)
    place = (grid.origin + random.uniform(0, 1, (feet, 3))).astype(np.float32)
    before = random.integers(0, feet, shape).astype(np.int32)
    held, row = _Held.beyond_all(shape), np.empty(shape, np.int32)
    slabs = [slice(0, 2), slice(2, 3), slice(3, 5)]
    for slab in slabs:
        held.measure(grid, Feet(place.T, place.T, np.zeros(feet, np.float32)), before, slab)
    for slab in slabs:
        held.take_closest(np.float32(grid.spacing), row, slab)
    node = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    steps = np.concatenate([np.zeros((1, 3), int), np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    there = np.clip(node[..., None, :] + steps, 0, np.array(shape) - 1)
    offered = place[before[tuple(np.moveaxis(there, -1, 0))]]
    x = grid.origin + grid.spacing * node
    least = np.linalg.norm(x[..., None, :] - offered, axis=-1).min(axis=-1)
    np.testing.assert_allclose(np.linalg.norm(x - place[row], axis=-1), least, atol=1e-6)
    assert (row != before).mean() > 0.3
