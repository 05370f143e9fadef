import numpy as np
import pytest
from scipy.spatial import KDTree

from core.trees import k_nearest, quick_tree


@pytest.mark.parametrize("make", [KDTree, quick_tree])
@pytest.mark.parametrize(("n", "k"), [(1, 1), (9, 1), (9, 4), (9, 9), (3, 5)])
def test_the_nearest_are_found_in_order_whatever_their_number(make, n, k, random):
    places, x = random.random((n, 3)), random.random((5, 3))
    distance, row = k_nearest(make(places), x, k)
    all_ = np.linalg.norm(x[:, None] - places, axis=2)
    np.testing.assert_array_equal(row, np.argsort(all_, axis=1)[:, :k])
    np.testing.assert_allclose(distance, np.sort(all_, axis=1)[:, :k])
