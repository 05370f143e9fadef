"""Distances read straight off the samples, without diffusion and integration: what a field has to beat.

Every function takes points (n,3), mostly with axes (n,3) whose sign does not matter, and queries (m,3), and returns
distances (m,).
"""

import numpy as np
from scipy.spatial import KDTree

from core.points import local_spacing

PLANE_NEIGHBOURS = 12  # samples that a plane is fitted to, and that are blended


def nearest_sample(points, x):
    return KDTree(points).query(x, workers=-1)[0]


def projection_field(points, axes, x):
    """The paper's projection distance field (section 3.1), its field without diffusion: the distance to the tangent
    plane of the nearest sample."""
    _, nearest = KDTree(points).query(x, workers=-1)
    return np.abs(np.einsum("mi,mi->m", x - points[nearest], axes[nearest]))


def blended_planes(points, axes, x):
    """Mean signed distance to the tangent planes of the 12 nearest samples, turned to agree with the nearest one's, by
    Gaussian weights as wide as the local spacing there."""
    distance, sample, offset, axis = _nearby(points, axes, x)
    width = local_spacing(points)[sample[:, :1]]
    weight = np.exp((distance[:, :1] ** 2 - distance**2) / width**2)
    weight *= np.where(np.einsum("mki,mi->mk", axis, axis[:, 0]) < 0, -1.0, 1.0)
    height = np.einsum("mki,mki->mk", offset, axis)
    return np.abs((weight * height).sum(axis=1)) / np.abs(weight).sum(axis=1)


def discs(points, axes, x, radius: float = 1.0):
    """Distance to the nearest of the discs across the axes of the 12 nearest samples, `radius` local spacings wide."""
    _, sample, offset, axis = _nearby(points, axes, x)
    height = np.einsum("mki,mki->mk", offset, axis)
    lateral = np.linalg.norm(offset - height[..., None] * axis, axis=2)
    return np.hypot(height, np.maximum(lateral - radius * local_spacing(points)[sample], 0)).min(axis=1)


def bracketed(points, axes, x, slack: float = 1.0):
    """The projection field, held between the distance to the nearest sample and `slack` local spacings less."""
    distance, nearest = KDTree(points).query(x, workers=-1)
    least = np.maximum(distance - slack * local_spacing(points)[nearest], 0)
    return np.clip(projection_field(points, axes, x), least, distance)


def _nearby(points, axes, x):
    distance, sample = KDTree(points).query(x, k=PLANE_NEIGHBOURS, workers=-1)
    return distance, sample, x[:, None] - points[sample], axes[sample]
