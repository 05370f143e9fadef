import numpy as np

from core.linalg import symmetric
from core.surface.signs.spreading import spread_signs


def test_signs_follow_the_links_from_the_first_of_each_part():
    relation, low, high = np.array([-1.0, 1, -1, -1]), np.array([0, 2, 5, 1]), np.array([2, 5, 3, 4])
    sign, part = spread_signs(symmetric(relation, low, high, 7))
    assert sign.tolist() == [1, 1, -1, 1, -1, -1, 1]
    assert part.tolist() == [0, 1, 0, 0, 1, 0, 2]


def test_without_links_all_are_one():
    sign, part = spread_signs(symmetric(*np.empty((3, 0), int), 3))
    assert (sign.tolist(), part.tolist()) == ([1, 1, 1], [0, 1, 2])
