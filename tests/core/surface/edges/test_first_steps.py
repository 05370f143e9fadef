import numpy as np
import pytest

from core.field.grid import fit_grid
from core.field.integration import distance_field
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.edges.first_steps import first_steps
from tests import shapes
from tests.bands import near_band
from tests.counted import Counted


@pytest.fixture(scope="module")
def hemisphere():
    """Of radius 1: its local surface, the grid and the nodes near it."""
    points = shapes.hemisphere(1500)
    surface = fit_local_surface(points, points, np.ones(len(points)), local_spacing(points), 3.0)
    grid = fit_grid(points, 40)
    return surface, grid, distance_field(surface, grid)[1]


def places(grid, off, count=4000):
    """Points `off` cells above and below the unit sphere, in the grid's box."""
    x = shapes.scattered_sphere(count)
    x = x * (1 + off * grid.spacing * np.where(np.arange(count) % 2, 1, -1))[:, None]
    return x[((x >= grid.origin) & (x <= grid.origin + grid.spacing * (np.array(grid.shape) - 1))).all(axis=1)]


def test_away_from_the_rim_steps_are_read_off_the_nodes_and_near_those_projected(hemisphere):
    surface, grid, band = hemisphere
    counted, x = Counted(surface), places(grid, 0.5)
    x = x[x[:, 2] > 0.3]
    step, past_rim = first_steps(x, band, counted, grid)
    assert counted.count < 0.2 * len(x)
    assert not past_rim.any()
    assert np.linalg.norm(step - surface.project(x).step, axis=1).max() < 0.05 * grid.spacing


def test_beside_the_rim_and_out_of_the_band_places_are_projected(hemisphere):
    surface, grid, band = hemisphere
    for x in (places(grid, 0.0), places(grid, 4.0)):
        x = x[(x[:, 2] < 0) | (np.abs(np.linalg.norm(x, axis=1) - 1) > 3 * grid.spacing)]
        step, past_rim = first_steps(x, band, surface, grid)
        expected = surface.project(x)
        np.testing.assert_array_equal(past_rim, expected.past_rim)
        np.testing.assert_array_equal(step, expected.step)


def test_outside_the_box_places_are_projected(hemisphere):
    surface, grid, _ = hemisphere
    every = np.arange(np.prod(grid.shape))
    known = near_band(grid.shape, every, surface.project(grid.positions(every)).step)
    x = grid.origin + grid.spacing * np.array([[-0.5, 12, 12], [12, 12, grid.shape[2] - 0.4]])
    np.testing.assert_array_equal(first_steps(x, known, surface, grid)[0], surface.project(x).step)
