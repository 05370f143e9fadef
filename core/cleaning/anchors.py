"""Some samples spread over a cloud, where noise is looked at, and their regions."""

import numpy as np
from scipy.spatial import KDTree

from ..progress import Progress
from ..spatial_order import spatial_order

REGION = 70  # anchors over which errors are averaged; over 45 of 1600 the sizes chosen leave steps in surfaces
SMOOTHING = 18  # anchors over which what was found is averaged

_ANCHORS = 2500
_SAMPLES = 32768  # at a time


def some_samples(points, count: int, seed: int) -> np.ndarray:
    """Rows (count,) of random samples (n,3), the same ones in whatever order those come."""
    return spatial_order(points)[np.random.default_rng(seed).choice(len(points), count, replace=False)]


def spread_anchors(points, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Some of the samples (n,3), their rows (m,), and for each the anchors nearest to it, itself first, (m,k)."""
    count = min(len(points), _ANCHORS)
    anchors = np.sort(some_samples(points, count, seed))
    return anchors, KDTree(points[anchors]).query(points[anchors], k=min(REGION, count), workers=-1)[1]


def nearest_anchor(points, anchors, progress: Progress) -> np.ndarray:
    """Which of the anchors (m,3) is nearest to each of the samples (n,3), (n,) int."""
    tree, nearest = KDTree(anchors), np.empty(len(points), np.int64)
    for part in progress.chunks(len(points), _SAMPLES):
        nearest[part] = tree.query(points[part], workers=-1)[1]
    return nearest
