"""Thin walls, told from noise: samples of two close sheets look noisy, but lie on the one or the other."""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import outer, principal_axes
from ..neighbourhoods.quadrics import nested_residuals

_SIZES = 32, 64, 128, 256  # neighbours: more than that see where walls end
_TWO = 1.6  # kurtosis below which samples are on two sheets; uniform noise leaves 1.8
_AROUND = 12  # anchors, over which it is typical
_LEAST = 0.08  # local spacings, half the distance of two sheets, at least: closer ones err as much as one in the middle
_SEEN = 0.05  # local spacings, half the distance of two sheets that say whether there is a shift, at least
_MOST = 2.0  # times the noise there seems to be, at most: walls farther apart do not look like that
_SHARE = 0.015  # of the anchors, at least, near two sheets; on noise of .1 to 1.5 spacings at most .005 are
_SHIFTED = 0.35  # times the squared errors of one distance all over, below which a shift explains them
_AXES, _DIVERSE = 3, 0.1  # normals along few axes leave hardly this share of the largest singular value in the fourth
_TWICE = np.array([1, 1, 1, 2, 2, 2])  # how often a product of two components stands in a symmetric form


def two_sheets(points, spacing, anchors, level: float, progress=None) -> tuple[np.ndarray, np.ndarray] | None:
    """Half the distances (w,) between two sheets, and normals (w,3), at those anchors around which samples (n,3) lie
    sharply on one sheet or the other, as those of thin walls do; None where too few are like that.

    points  : (n,3) float64, n > 32     spacing : (n,) float64, local spacing, same units
    anchors : (m,) int, rows that look noisy
    level   : local spacings, of the noise that they seem to have, which would spread them about one sheet
    """
    fits = nested_residuals(points, anchors, [k for k in _SIZES if k < len(points)], progress)
    around = KDTree(points[anchors]).query(points[anchors], k=min(_AROUND, len(anchors)), workers=-1)[1]
    kurtosis = np.stack([np.median(fit.kurtosis[around], axis=1) for fit in fits])
    best, row = np.nan_to_num(kurtosis, nan=np.inf).argmin(axis=0), np.arange(len(anchors))
    half = np.stack([fit.level for fit in fits])[best, row]
    relative = half / spacing[anchors]
    two = (kurtosis[best, row] < _TWO) & (relative > _SEEN) & (relative < _MOST * level)
    if (two & (relative > _LEAST)).sum() < max(_AROUND, _SHARE * len(two)):
        return None
    return half[two], np.stack([fit.normal for fit in fits])[best, row][two]


def is_shift(half: np.ndarray, normal: np.ndarray) -> bool:
    """Whether two sheets with half the distances (w,) and normals (w,3) are two scans of one surface, shifted against
    each other: these are as far apart as the shift is long along the normal, walls all over alike. With few directions
    a shift may fit walls, too: no then."""
    products = outer(normal) * _TWICE
    squares, _, _, kinds = np.linalg.lstsq(products, half**2, rcond=None)
    if kinds[_AXES] < _DIVERSE * kinds[0]:
        return False
    axis = principal_axes(squares[None])
    squared = max(((outer(axis) * _TWICE) @ squares).item(), 0.0)
    off = half - np.abs(normal @ axis[0]) * np.sqrt(squared)
    return off @ off < _SHIFTED * len(half) * half.var()
