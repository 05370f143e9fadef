import numpy as np
import pytest
from scipy.spatial import KDTree

from core.progress import Progress
from core.trees import k_nearest, nearest_others, quick_tree


@pytest.mark.parametrize("make", [KDTree, quick_tree])
@pytest.mark.parametrize(("n", "k"), [(1, 1), (9, 1), (9, 4), (9, 9), (3, 5)])
def test_the_nearest_are_found_in_order_whatever_their_number(make, n, k, random):
    places, x = random.random((n, 3)), random.random((5, 3))
    distance, row = k_nearest(make(places), x, k)
    all_ = np.linalg.norm(x[:, None] - places, axis=2)
    np.testing.assert_array_equal(row, np.argsort(all_, axis=1)[:, :k])
    np.testing.assert_allclose(distance, np.sort(all_, axis=1)[:, :k])


@pytest.mark.parametrize(("n", "k"), [(2, 1), (9, 4), (9, 8), (3, 5), (20_000, 3)])
def test_the_nearest_others_of_each_are_in_order_and_leave_itself_out(n, k, random):
    places = random.random((n, 3))
    distance, row = nearest_others(KDTree(places), k, Progress())
    some = np.array([0, n // 2, n - 1])
    all_ = np.linalg.norm(places[some, None] - places, axis=2)
    np.testing.assert_array_equal(row[some], np.argsort(all_, axis=1)[:, 1 : k + 1])
    np.testing.assert_allclose(distance[some], np.sort(all_, axis=1)[:, 1 : k + 1])
    assert row.shape == distance.shape == (n, min(k, n - 1))
