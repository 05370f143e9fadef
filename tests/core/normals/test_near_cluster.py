import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from core.normals.near_cluster import near_cluster

groups = st.lists(st.lists(st.floats(0, 100), min_size=1, max_size=9), min_size=1, max_size=6)


def scatter(values):
    return ((values - values.mean()) ** 2).sum() if len(values) else 0.0


@given(groups, st.randoms(use_true_random=False))
def test_no_split_of_a_sample_has_less_scatter(distances, shuffler):
    site = np.repeat(np.arange(len(distances)) * 3, [len(group) for group in distances])
    distance = np.concatenate(distances)
    order = list(range(len(site)))
    shuffler.shuffle(order)
    near = np.empty(len(site), bool)
    near[order] = near_cluster(site[order], distance[order])
    for k, group in enumerate(distances):
        own, values = near[site == 3 * k], np.sort(group)
        assert own.any()
        if own.all():
            assert np.ptp(values) <= 1e-9 * values.max()
            continue
        least = min(scatter(values[:m]) + scatter(values[m:]) for m in range(1, len(values)))
        assert scatter(distance[site == 3 * k][own]) + scatter(distance[site == 3 * k][~own]) <= least + 1e-6
        assert distance[site == 3 * k][own].max() <= distance[site == 3 * k][~own].min()


def test_two_rings_of_neighbours_are_told_apart():
    site = np.repeat([0, 1], 6)
    distance = np.array([1.0, 5.2, 1.1, 4.9, 0.9, 5.0, 10, 10, 10, 30, 30, 30])
    assert near_cluster(site, distance).tolist() == [True, False] * 3 + [True] * 3 + [False] * 3


def test_a_single_neighbour_and_equal_distances_are_kept():
    assert near_cluster(np.array([4, 7, 7, 7]), np.array([3.0, 2.0, 2.0, 2.0])).all()
    assert near_cluster(np.full(6, 7), 0.1 * (1 + 1e-14 * np.arange(6))).all()
