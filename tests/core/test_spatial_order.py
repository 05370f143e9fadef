import numpy as np

from core.spatial_order import spatial_order
from tests import shapes


def test_halves_come_one_after_the_other_on_every_scale():
    grid = np.indices((4, 4, 4)).reshape(3, -1).T
    order = grid[spatial_order(grid)]
    np.testing.assert_array_equal(order[:8], np.indices((2, 2, 2)).reshape(3, -1).T)
    np.testing.assert_array_equal(order[::8] // 2, order[:8])


def test_points_that_follow_each_other_are_close():
    points = shapes.scattered_sphere(20_000)
    order = spatial_order(points)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(points)))
    step = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    assert np.median(step) < 3 * np.sqrt(4 * np.pi / len(points))


def test_points_in_one_cell_are_in_the_order_of_their_coordinates():
    two = np.tile([[1.0, 2.0, 3.0], [0.0, 2.0, 3.0]], (3000, 1)) + np.linspace(1e-8, 0, 6000)[:, None]
    points = np.concatenate([[[-1.3, -1.3, -1.3]], two, [[5.1, 5.1, 5.1]]])
    np.testing.assert_array_equal(spatial_order(points), [0, *range(6000, 0, -2), *range(5999, 0, -2), 6001])
    level = np.array([[1e9, 0, 0], [0, 2, 1], [0, 1, 2], [0, 1, 1.0]])
    np.testing.assert_array_equal(spatial_order(level), [3, 2, 1, 0])


def test_the_order_given_does_not_matter(random):
    points = np.concatenate([shapes.scattered_sphere(400), [[1e8, 0, 0]]])
    order = random.permutation(len(points))
    np.testing.assert_array_equal(points[order][spatial_order(points[order])], points[spatial_order(points)])


def test_place_and_scale_do_not_matter_nor_does_a_point_alone():
    points = shapes.scattered_sphere(500)
    np.testing.assert_array_equal(spatial_order(points * 2.0**-70), spatial_order(points * 2.0**70))
    np.testing.assert_array_equal(spatial_order(points + 1.0), spatial_order(points))
    assert list(spatial_order(np.ones((3, 3)))) == [0, 1, 2]
