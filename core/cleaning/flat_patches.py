"""Flat patches, told from noise: samples of a mesh lie on its faces, far closer than noise would leave any."""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import outer, principal_axes
from .eyes import seen_edge_on

_NEIGHBOURS, _PLANES = 32, 64  # of each anchor, and planes tried through it and two of those
_FLAT = 0.02  # times the noise there seems to be, off a plane; noise leaves two in a hundred samples so close
_MORE = 6  # samples on a plane, beside the three that it is laid through; of noise hardly any has so many
_SLIM = 0.2  # sine of the angle at the anchor, at least
_SHARE = 0.03  # of the anchors, at least, with such a plane; on noise of .1 and .3 spacings .0012 have one at most
_STEPS = 0.25  # times the noise, steps of rounding, at most: .0024 have one then, with steps as long up to .46
_SAME = 1e-9  # of the extent, by which values of one step differ


def shows_flat_patches(points, spacing, anchors, level: float) -> bool:
    """Whether samples (n,3) that seem to have noise of `level` local spacings lie on faces of a mesh, and are free of
    noise: many together on one plane, as sheets have that are too close for their samples.

    points  : (n,3) float64, n > 32     spacing : (n,) float64, local spacing, same units
    anchors : (m,) int, rows that look noisy

    Says no where a coordinate is rounded to steps that are not far smaller than the noise, as they would lay it on
    planes, too. Where rounded points were turned afterwards, steps as long as the noise are taken for faces. Planes
    that hold the eye of a scanner are none: noise along its rays leaves rows and columns of its picture in such.
    """
    if _steps(points).max() > _STEPS * level * np.median(spacing[anchors]):
        return False
    beside = KDTree(points).query(points[anchors], k=_NEIGHBOURS, workers=-1)[1][:, 1:]
    offset = (points[beside] - points[anchors][:, None]) / (level * spacing[anchors])[:, None, None]
    length = np.linalg.norm(offset, axis=2)
    most, best = np.full(len(anchors), _MORE - 1), np.zeros((len(anchors), 3))
    rng = np.random.default_rng(0)
    for _ in range(_PLANES):
        a, b = rng.choice(_NEIGHBOURS - 1, 2, replace=False)
        normal = np.cross(offset[:, a], offset[:, b])
        size = np.linalg.norm(normal, axis=1)
        flat = np.abs(np.einsum("mki,mi->mk", offset, normal)) < _FLAT * size[:, None]
        laid = np.where(size > _SLIM * length[:, a] * length[:, b], flat.sum(axis=1) - 2, 0)
        fuller = laid > most
        most[fuller], best[fuller] = laid[fuller], normal[fuller] / size[fuller, None]
    found = best.any(axis=1)
    least = _SHARE * len(anchors)
    if found.sum() < least:
        return False
    off = offset[found] - offset[found].mean(axis=1, keepdims=True)
    sheets = principal_axes(-outer(off).sum(axis=1))
    return bool((~seen_edge_on(points[anchors[found]], best[found], sheets)).sum() >= least)


def _steps(points):
    """The least difference of two values along each axis, (3,)."""
    gaps = np.diff(np.sort(points, axis=0), axis=0)
    return np.where(gaps > _SAME * np.ptp(points, axis=0), gaps, np.inf).min(axis=0)
