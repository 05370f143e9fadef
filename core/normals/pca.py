"""Normals from a plane through the nearest samples: the baseline that the Voronoi solver is compared with."""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import eigenvalues, outer, principal_axes

NEIGHBOURS = 10


def pca_normals(points: np.ndarray, neighbours: int = NEIGHBOURS) -> tuple[np.ndarray, np.ndarray]:
    """Axes (n,3) and confidence (n,) in [0,1] of samples (n,3): direction of least variance of the `neighbours`
    nearest and the sample itself, and one minus the ratio of the two smaller variances."""
    k = min(neighbours, len(points) - 1)
    group = points[KDTree(points).query(points, k=k + 1, workers=-1)[1]]
    group = group - group.mean(axis=1, keepdims=True)
    tensors = -outer(group).mean(axis=1)
    least, middle, _ = -eigenvalues(tensors).T
    return principal_axes(tensors), np.clip(1 - least / np.maximum(middle, np.finfo(float).tiny), 0.0, 1.0)
