"""Thin walls, told from noise: samples of two close sheets look noisy, but lie on the one or the other."""

from dataclasses import dataclass

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
_OFTEN = 0.4  # of the anchors with errors as large, near two sheets, above which they are of two scans, or of walls
# Of two scans and of more: the fourth of the singular values over the first, which few directions leave less of; and
# the squared errors over those of one distance all over, below which a shift explains them.
_TWO_SCANS, _MORE_SCANS = (0.1, 0.35), (0.35, 0.8)
_TWICE = np.array([1, 1, 1, 2, 2, 2])  # how often a product of two components stands in a symmetric form


@dataclass(frozen=True)
class TwoSheets:
    """What anchors see that are as far off the surface as sheets may be that look like noise.

    half   : (w,) float64, how far the samples around each are off it, root mean square: half the distance of two sheets
    normal : (w,3) float64, unit normals     two : (w,) bool, around which samples lie sharply on one sheet or the other
    """

    half: np.ndarray
    normal: np.ndarray
    two: np.ndarray

    @property
    def typical_half(self) -> float:
        """The median half distance of two sheets."""
        return float(np.median(self.half[self.two]))

    def are_scans(self) -> bool:
        """Whether these are scans of one surface, shifted against each other, and no walls.

        Two scans show two sheets nearly all over, which are as far apart as the shift is long along the normal; walls
        are as thick one way as the other. More scans, or noisy ones, show two sheets here and there alone, but what
        they are off their mean, squared, is a quadratic form of the normal: the covariance of the shifts. With few
        directions a shift may fit walls, too: no then."""
        of_two = self.two.mean() > _OFTEN
        diverse, explained = _TWO_SCANS if of_two else _MORE_SCANS
        chosen = self.two if of_two else slice(None)
        half, products = self.half[chosen], outer(self.normal[chosen]) * _TWICE
        form, _, _, kinds = np.linalg.lstsq(products, half**2, rcond=None)
        if kinds[3] < diverse * kinds[0]:
            return False
        if of_two:
            axis = outer(principal_axes(form[None]))[0]
            form = max(axis @ (_TWICE * form), 0.0) * axis
        off = half - np.sqrt(np.maximum(products @ form, 0))
        return bool(off @ off < explained * len(half) * half.var())


def find_two_sheets(points, spacing, anchors, level: float, progress=None) -> TwoSheets | None:
    """Two sheets around those anchors where samples (n,3) lie sharply on one or the other, as those of thin walls do;
    None where too few are like that.

    points  : (n,3) float64, n > 32     spacing : (n,) float64, local spacing, same units
    anchors : (m,) int, rows that look noisy
    level   : local spacings, of the noise that they seem to have, which would spread them about one sheet
    """
    fits = nested_residuals(points, anchors, [k for k in _SIZES if k < len(points)], progress)
    around = KDTree(points[anchors]).query(points[anchors], k=min(_AROUND, len(anchors)), workers=-1)[1]
    kurtosis = np.stack([np.median(fit.kurtosis[around], axis=1) for fit in fits])
    best, row = np.nan_to_num(kurtosis, nan=np.inf).argmin(axis=0), np.arange(len(anchors))
    half, normal = (np.stack([getattr(fit, name) for fit in fits])[best, row] for name in ("level", "normal"))
    relative = half / spacing[anchors]
    near = (relative > _SEEN) & (relative < _MOST * level)
    two = near & (kurtosis[best, row] < _TWO)
    if (two & (relative > _LEAST)).sum() < max(_AROUND, _SHARE * len(two)):
        return None
    return TwoSheets(half[near], normal[near], two[near])
