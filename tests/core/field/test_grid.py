import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.field.grid import PADDING, Grid, fit_grid
from tests import shapes

sides = st.floats(0.01, 100)


def box(*size):
    """The corners of a box with its lowest one at (3, -2, 5)."""
    return np.indices((2, 2, 2)).reshape(3, -1).T * np.array(size, float) + [3, -2, 5]


@given(sides, sides, st.sampled_from([0.0, 0.3, 4.0]), st.integers(16, 100))
def test_covers_the_padded_box_with_whole_cells(a, b, c, resolution):
    points = box(a, b, c)
    grid = fit_grid(points, resolution)
    padding = PADDING * max(a, b, c)
    high = grid.origin + grid.spacing * (np.array(grid.shape) - 1)
    slack = 1e-6 * grid.spacing
    for low_side, high_side in ((grid.origin, points.min(axis=0) - padding), (points.max(axis=0) + padding, high)):
        assert (low_side <= high_side + slack).all()
    wanted = np.ptp(points, axis=0) + 2 * padding
    assert (high - grid.origin - wanted < grid.spacing + slack).all()
    np.testing.assert_allclose((grid.origin + high) / 2, (points.min(axis=0) + points.max(axis=0)) / 2, atol=1e-9)


@pytest.mark.parametrize("resolution", [16, 31, 64, 255])
def test_the_longest_side_has_as_many_cells_as_asked(resolution):
    assert max(fit_grid(box(1, 3, 2), resolution).shape) == resolution + 1


def test_single_precision_and_whole_numbers_make_the_grid_of_doubles():
    points = box(1, 2, 3)
    for kind in (np.float32, np.int16):
        grid, same = fit_grid(points, 20), fit_grid(points.astype(kind), 20)
        assert same.spacing == grid.spacing
        np.testing.assert_array_equal(same.origin, grid.origin)


def test_a_cube_has_equal_sides():
    assert fit_grid(box(1, 1, 1), 40).shape == (41, 41, 41)


def test_a_flat_cloud_keeps_its_padding():
    points = shapes.disc(50)
    grid = fit_grid(points, 40)
    assert grid.spacing * (grid.shape[2] - 1) > 2 * PADDING * np.ptp(points, axis=0).max() - 1e-9


def test_positions_follow_the_array():
    grid = Grid(np.array([1.0, 2.0, 3.0]), 0.5, (2, 3, 4))
    index = np.arange(24).reshape(2, 3, 4)[1, 2, 3]
    np.testing.assert_array_equal(grid.positions(np.array([0, index])), [[1, 2, 3], [1.5, 3, 4.5]])


def test_nearest_node_is_the_nearest(random):
    grid = fit_grid(box(1, 2, 3), 20)
    high = grid.origin + grid.spacing * (np.array(grid.shape) - 1)
    x = random.uniform(grid.origin, high, (300, 3))
    every = grid.positions(np.arange(np.prod(grid.shape)))
    expected = np.linalg.norm(x[:, None] - every, axis=2).argmin(axis=1)
    np.testing.assert_array_equal(grid.nearest_nodes(x), expected)
    np.testing.assert_array_equal(grid.nearest_nodes(every), np.arange(len(every)))
