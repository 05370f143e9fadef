import numpy as np

from core.linalg import symmetric
from core.surface.signs.spreading import spread_signs, spread_strongest


def test_signs_follow_the_links_from_the_first_of_each_part():
    relation, low, high = np.array([-1.0, 1, -1, -1]), np.array([0, 2, 5, 1]), np.array([2, 5, 3, 4])
    sign, part = spread_signs(symmetric(relation, low, high, 7))
    assert sign.tolist() == [1, 1, -1, 1, -1, -1, 1]
    assert part.tolist() == [0, 1, 0, 0, 1, 0, 2]


def test_without_links_all_are_one():
    sign, part = spread_signs(symmetric(*np.empty((3, 0), int), 3))
    assert (sign.tolist(), part.tolist()) == ([1, 1, 1], [0, 1, 2])


def test_the_strongest_links_that_connect_all_decide():
    """Around a ring of four the weakest of them disagrees with the others."""
    low, high = np.array([0, 1, 2, 3]), np.array([1, 2, 3, 0])
    for weakest in range(4):
        relation = np.where(np.arange(4) == weakest, -0.5, 2.0)
        assert spread_strongest(symmetric(relation, low, high, 4))[0].tolist() == [1, 1, 1, 1]
    sign, part = spread_strongest(symmetric(np.array([-3.0, 1]), np.array([0, 2]), np.array([1, 3]), 5))
    assert (sign.tolist(), part.tolist()) == ([1, -1, 1, 1, 1], [0, 0, 1, 1, 2])
