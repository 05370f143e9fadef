"""Noise told from detail, by how far samples lie off the quadrics through few and through more of their neighbours."""

from dataclasses import dataclass

import numpy as np

from ..neighbourhoods.quadrics import GAUSS, nested_quadrics
from ..progress import Progress
from .anchors import REGION, spread_anchors

_FEW, _MORE, _MANY = 12, 20, 32  # neighbours
_EVERYWHERE = 0.04  # local spacings: nine tenths of the regions of a noisy cloud are above it
_LEVEL = 0.05  # local spacings: half of them are above this
_GROWTH = 1.15  # from few to more neighbours noise hardly grows, detail that the samples miss does
_DROWNED = 0.3  # local spacings: above it few neighbours see too little of the noise for that comparison
_DETAIL = 1.2  # times that errors grow from few to many neighbours where averaging would blunt more than noise does
_FLOODED = 0.4  # local spacings: above it noise itself grows so much
_SLIGHT = 0.006  # local spacings: nine tenths of the regions of a slightly noisy cloud are above it
_UNLIKE = 10.0  # times as rough as its smoothest tenth is the roughest tenth of a cloud that is noisy in parts only
_ALIKE = 1.1  # from few to more, and from more to many, slight noise grows less, detail that averaging would blunt more
_SMALLEST_PART = 0.05  # of a cloud that is noisy in parts
_FAINT = 0.03  # local spacings: errors in parts that are evenly noisy are above it
_GROWS = 1.2  # times that these grow at most, from few to more
_AMID = 0.8  # of the anchors around one in the core of such a part, these look so as well
_CORE = 0.02  # of a cloud, the cores of such parts together


@dataclass(frozen=True)
class Roughness:
    """How far samples lie off quadrics, and where that looks like noise.

    loud, slight : whether the cloud as a whole looks noisy, or may be so by hundredths of a local spacing
    suspect      : (m,) bool, which anchors look noisy     relative : (m,) how far these are off, local spacings
    even         : (m,) bool, which do amid others that do, through any number of neighbours
    anchors      : (m,) rows of the samples                region   : (m,k) the anchors nearest to each
    """

    loud: bool
    slight: bool
    suspect: np.ndarray
    even: np.ndarray
    relative: np.ndarray
    anchors: np.ndarray
    region: np.ndarray

    @property
    def whole(self) -> bool:
        """Whether the cloud as a whole may be noisy."""
        return self.loud or self.slight


def roughness(points, spacing, seed: int, progress: Progress) -> Roughness:
    """How rough samples (n,3) with local spacing (n,) are; more than 32 of them."""
    anchors, region = spread_anchors(points, seed)

    def missed(sizes, part):
        fits = nested_quadrics(points, anchors, sizes, part)
        return [GAUSS * np.median(fit.left_out()[region], axis=1) for fit in fits]

    fine, wide = missed((_FEW, _MORE), progress.part(0.0, 0.08))
    relative = wide / np.median(spacing[anchors][region], axis=1)
    growth = _ratio(wide, fine)
    everywhere, level, roughest = np.percentile(relative, (10, 50, 90))
    suspect = _rough(relative, growth)
    even = (relative > _FAINT) & (relative < _DROWNED) & (growth < _GROWS)
    loud = everywhere > _EVERYWHERE and _rough(level, np.median(growth))
    slight = everywhere > max(_SLIGHT, roughest / _UNLIKE) and np.median(growth) < _ALIKE
    if loud or slight or suspect.sum() >= least_part(anchors) or even.mean() >= _CORE:
        (wider,) = missed((_MANY,), progress.part(0.08, 0.1))
        further, last = _ratio(wider, fine), _ratio(wider, wide)
        suspect &= ~_detailed(relative, further)
        loud &= not _detailed(level, np.median(further))
        slight &= np.median(last) < _ALIKE
        even &= last < _ALIKE
    return Roughness(bool(loud), bool(slight), suspect, _in_parts(even, region), relative, anchors, region)


def least_part(anchors) -> float:
    """How many of the anchors (m,) a noisy part has at least."""
    return max(REGION, _SMALLEST_PART * len(anchors))


def _ratio(a, b):
    return a / np.maximum(b, np.finfo(float).tiny)


def _in_parts(even, region):
    """Those of some anchors, (m,) bool, that are near the core of a part; none where the cores are small."""
    core = even[region].mean(axis=1) > _AMID
    return even & (core.mean() >= _CORE) & core[region].any(axis=1)


def _rough(relative, growth):
    """Whether errors in local spacings, and their growth from few to more neighbours, are those of noise."""
    return (relative > _LEVEL) & ((growth < _GROWTH) | (relative > _DROWNED))


def _detailed(relative, further):
    """Whether errors in local spacings grow too much from few to many neighbours, by the factor `further`, for noise
    alone; those that noise has drowned grow as well."""
    return (further > _DETAIL) & (relative < _FLOODED)
