import numpy as np

from core.spatial_order import spatial_order
from tests import shapes


def test_halves_come_one_after_the_other_on_every_scale():
    grid = np.indices((4, 4, 4)).reshape(3, -1).T
    order = grid[spatial_order((grid - 1.5) / 3)]
    np.testing.assert_array_equal(order[:8], np.indices((2, 2, 2)).reshape(3, -1).T)
    np.testing.assert_array_equal(order[::8] // 2, order[:8])


def test_points_that_follow_each_other_are_close():
    points = 0.5 * shapes.scattered_sphere(20_000)
    order = spatial_order(points)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(points)))
    step = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    assert np.median(step) < 3 * np.sqrt(np.pi / len(points))


def test_points_in_one_cell_stay_in_order():
    points = np.tile([[0.3, 0.1, -0.4], [-0.3, 0.2, 0.0]], (3000, 1)) + np.linspace(0, 1e-8, 6000)[:, None]
    np.testing.assert_array_equal(spatial_order(points), [*range(1, 6000, 2), *range(0, 6000, 2)])


def test_the_box_may_be_overstepped_by_rounding():
    assert list(spatial_order(np.array([[0.5 + 1e-15] * 3, [-0.5 - 1e-15] * 3]))) == [1, 0]
