"""Nodes that may lie near the surface are found without projecting all of them, few besides and hardly one too few."""

import numpy as np
import pytest

from core import Cancelled
from core.field.grid import Grid, fit_grid
from core.field.local_surface import fit_local_surface
from core.field.near_nodes import near_nodes
from core.points import local_spacing
from tests import shapes

WIDTH = 2.0  # cells


def ball(n=500):
    points = shapes.sphere(n)
    return fit_local_surface(points, points, np.ones(n), local_spacing(points), 3.0)


@pytest.mark.parametrize("samples", [12, 60, 500, 8000, 60000], ids=["few", "sparse", "usual", "dense", "denser"])
def test_they_are_those_that_a_projection_of_every_node_finds_and_few_more(samples):
    surface = ball(samples)
    grid = fit_grid(surface.points, 48)
    found = near_nodes(surface, grid, WIDTH)
    distance = surface.project(grid.positions(np.arange(np.prod(grid.shape)))).distance / grid.spacing
    true = np.flatnonzero(distance <= WIDTH)
    assert np.isin(true, found).mean() > 0.9995
    assert len(found) < (1.5 if samples == 500 else 8.0) * len(true)
    assert (np.diff(found) > 0).all()


def test_nodes_outside_the_box_are_none():
    """A box that holds the samples with no room to spare."""
    surface = ball()
    grid = Grid(np.full(3, -1.0), 0.05, (41, 41, 41))
    found = near_nodes(surface, grid, WIDTH)
    distance = surface.project(grid.positions(np.arange(np.prod(grid.shape)))).distance / grid.spacing
    assert found.max() < np.prod(grid.shape)
    np.testing.assert_array_equal(found[distance[found] <= WIDTH], np.flatnonzero(distance <= WIDTH))


def test_reports_and_stops_when_told():
    surface, seen = ball(), []
    grid = fit_grid(surface.points, 48)
    near_nodes(surface, grid, WIDTH, lambda fraction, _: seen.append(fraction))
    assert seen == sorted(seen)
    with pytest.raises(Cancelled):
        near_nodes(surface, grid, WIDTH, lambda fraction, _: False)
