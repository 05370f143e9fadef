"""Trees of places: made quickly where few ask, and asked for several neighbours at once."""

import numpy as np
from scipy.spatial import KDTree

from .progress import Progress

_CHUNK = 16384  # places


def quick_tree(places: np.ndarray) -> KDTree:
    """A tree of places (n,3) for few queries: quicker to make than the usual one, slower to ask."""
    return KDTree(places, balanced_tree=False, compact_nodes=False)


def k_nearest(tree: KDTree, x: np.ndarray, k: int, workers: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Distances from x (m,3) to the `k` nearest places of a tree, or to all where these are fewer, nearest first, and
    the rows of those, (m,k) each. A number would leave out the second axis where it is 1, a range never does."""
    return tree.query(x, k=range(1, 1 + min(k, tree.n)), workers=workers)


def nearest_others(tree: KDTree, k: int, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Distances from each place of a tree to the `k` nearest others, or to all where these are fewer, nearest first,
    and the rows of those, (n,k) each. The places are distinct."""
    k = min(k, tree.n - 1)
    distance, row = np.empty((tree.n, k)), np.empty((tree.n, k), np.int64)
    for part in progress.chunks(tree.n, _CHUNK):
        for found, there in zip((distance, row), tree.query(tree.data[part], k=k + 1, workers=-1), strict=True):
            found[part] = there[:, 1:]
    return distance, row
