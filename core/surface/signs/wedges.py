"""Two walls of a closed shape so close that no node lies between them, as at the ends of wedges and in thin walls.

Edges of the grid are seen to cross one wall there, with the outside at both ends, as around a flap. Samples tell them
apart: those of a flap are on one sheet.
"""

import numpy as np
from scipy.spatial import KDTree

from ...field.grid import ADJACENT
from ...field.local_surface import LocalSurface
from ...neighbourhoods.quadrics import fit_quadrics
from ...parts import near_parts

_CREASE = 2.0  # local spacings off a crease, where a wedge ends
_NARROW = 2.0  # cells from where a node lies between its walls
_NEIGHBOURS, _OFF = 24, 0.025  # of samples, and local spacings that those of one sheet are off quadrics through these
_MANY = 0.01  # of all crossings, at least; square edges have fewer, and samples of a smaller patch are off by chance
_MOST = 0.6  # of those with the outside at both ends, at least, that samples show two walls at; fewer are chance
_SOME = 0.2  # of those of a connected patch, at least; a flap shows some where it joins the rest


def at_wedges(
    places: np.ndarray, parting: np.ndarray, passing: np.ndarray, surface: LocalSurface, cell: float
) -> np.ndarray:
    """Which crossings with the outside at both ends, at places (w,3), are those of two walls, (w,) bool: where such
    crossings are many, and most of them are shown to be, all patches that some are shown in. It is shown by samples on
    sheets side by side (see :func:`sheet_room`), by those beside a crease, close to crossings at `parting` (p,3) that
    part inside and outside, and, as under noise, by those off the one sheet that a large patch would be; but not close
    to lines along which sheets pass through one another, `passing` (n,) bool, where wedges end that are known. None are
    where nothing parts the two, as around an open sheet."""
    many = _MANY * (len(places) + len(parting))
    if len(places) <= many or not len(parting):
        return np.zeros(len(places), bool)
    sample, patch = surface.tree.query(places, workers=-1)[1], near_parts(places, ADJACENT * cell)
    crease = surface.rims.limit[sample].min(axis=1) <= _CREASE * surface.spacing[sample]
    narrow = np.isfinite(KDTree(parting).query(places, distance_upper_bound=_NARROW * cell, workers=-1)[0])
    shown = np.isfinite(surface.room[sample]) | (crease & narrow)
    shown |= _is_scattered(patch, sample, many, surface)[patch]
    shown &= ~passing[sample]
    some = np.bincount(patch, shown) >= _SOME * np.bincount(patch)
    return some[patch] & ~passing[sample] & (shown.mean() >= _MOST)


def _is_scattered(patch, sample, least, surface):
    """Which patches have so many crossings at least, and their samples off the sheet through the neighbours of each;
    from the patch and the sample (w,) of each crossing."""
    points, size = surface.points, np.bincount(patch)
    large, scattered = np.flatnonzero(size >= least), np.zeros(len(size), bool)
    if not len(large):
        return scattered
    chosen = np.isin(patch, large)
    among, own = np.unique([patch[chosen], sample[chosen]], axis=1)
    off = fit_quadrics(points, own, min(_NEIGHBOURS, len(points))).height / surface.spacing[own]
    scattered[large] = [np.median(off[among == each]) > _OFF for each in large]
    return scattered
