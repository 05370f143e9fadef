import numpy as np
import pytest

from core.neighbourhoods.clusters import Clusters
from tests import shapes


def test_points_on_a_line_go_together_in_order():
    points = np.zeros((16, 3))
    points[:, 1] = np.random.default_rng(0).permutation(16)
    np.testing.assert_array_equal(np.sort(Clusters(points).means(4)[:, 1]), [1.5, 5.5, 9.5, 13.5])


def test_halves_are_taken_across_the_longest_side():
    points = np.array([[0, 0, 0], [9, 1, 0], [9, 0, 2], [0, 1, 2]], float)
    means = Clusters(points).means(2)
    np.testing.assert_allclose(means[np.argsort(means[:, 0])], [[0, 0.5, 1], [9, 0.5, 1]])


@pytest.mark.parametrize("n", [1000, 1023, 1025])
def test_clusters_are_at_least_half_as_large_as_asked_and_small_in_space(n):
    points = np.random.default_rng(1).random((n, 3)) * [4, 4, 0]
    for size in (2, 5, 64):
        means = Clusters(points).means(size)
        assert n / size <= len(means) <= 2 * n / size
        side = 4 * np.sqrt(size / n)
        away = np.linalg.norm(points[:, None] - means, axis=2).min(axis=1)
        assert away.max() < 2.5 * side


def test_the_order_of_the_points_does_not_matter():
    points = shapes.scattered_sphere(500)
    here, there = Clusters(points).means(8), Clusters(points[::-1]).means(8)
    np.testing.assert_allclose(here[np.lexsort(here.T)], there[np.lexsort(there.T)], atol=1e-12)


def test_few_points_are_one_cluster_and_equal_ones_are_parted_too():
    points = np.full((7, 3), 2.0)
    np.testing.assert_array_equal(Clusters(points).means(8), [[2, 2, 2]])
    np.testing.assert_array_equal(Clusters(points).means(2), np.full((4, 3), 2.0))
