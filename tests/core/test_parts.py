import numpy as np
import pytest

from core.parts import connected_parts, extents, near_parts


def test_parts_are_numbered_as_they_come():
    assert connected_parts(np.array([3, 0]), np.array([1, 2]), 5).tolist() == [0, 1, 0, 1, 2]


@pytest.mark.parametrize(("reach", "parts"), [(0.5, [0, 1, 2, 3]), (1.5, [0, 1, 0, 1]), (10.0, [0, 0, 0, 0])])
def test_places_within_reach_of_each_other_are_one_part(reach, parts):
    assert near_parts(np.array([[0, 0, 0], [5, 0, 0], [0, 1, 0], [5, 0, 1.0]]), reach).tolist() == parts


def test_no_places_have_no_parts():
    assert near_parts(np.empty((0, 3)), 1.0).tolist() == []


def test_parts_are_as_long_as_the_boxes_around_them():
    place = np.array([[0.0, 0, 0], [5, 5, 5], [3, 0, 1], [1, 4, 0]])
    np.testing.assert_array_equal(extents(np.array([0, 1, 0, 0]), place), [np.sqrt(9 + 16 + 1), 0])
