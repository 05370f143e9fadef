"""Near neighbours: the closer of two groups that the distances to a sample's Voronoi neighbours fall into."""

import numpy as np

_EQUAL = 1e-10  # of their mean, by which equal distances differ


def near_cluster(site: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Exact 1-D 2-means of each sample's neighbour distances (section 4.2 of the paper).

    site     : (p,) int, the sample that each distance belongs to
    distance : (p,) float64
    Returns (p,) bool, True for the cluster nearer to its sample. A sample with a single neighbour keeps it, and one
    whose distances are all equal keeps all.

    In one dimension the best two clusters are separated by a threshold. Sorted, with S_k the sum of the k smallest of
    m, the scatter within the clusters is least where S_k^2 / k + (S_m - S_k)^2 / (m - k) is largest.
    """
    order = np.lexsort((distance, site))
    owner, value = site[order], distance[order]
    begins = np.flatnonzero(np.diff(owner, prepend=-1))
    size = np.diff(begins, append=len(owner))
    group = np.repeat(np.arange(len(begins)), size)

    mean = np.add.reduceat(value, begins) / size
    value = value - mean[group]
    k = np.arange(len(owner)) - begins[group] + 1
    running = np.cumsum(value)
    running -= (running[begins] - value[begins])[group]
    rest = size[group] - k
    gain = np.where(rest > 0, running**2 * (1 / k + 1 / np.maximum(rest, 1)), 0.0)
    # S_m is zero about the mean
    best = np.lexsort((k, -gain, group))[begins]
    near = np.empty(len(site), bool)
    equal = np.maximum.reduceat(gain, begins) <= size * (_EQUAL * mean) ** 2
    near[order] = (k <= k[best][group]) | equal[group]
    return near
