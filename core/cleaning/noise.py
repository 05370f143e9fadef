"""How noisy the samples are, and over how many neighbours the surface is best averaged, region by region."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..normals.mirrors import Mirrors
from ..normals.reflection import reflection_sweeps
from ..progress import Progress
from ..voronoi.facets import voronoi_facets
from .quadrics import GAUSS, nested_quadrics

LADDER = (12, 20, 32, 50, 80, 128, 200)  # neighbours tried
MINIMUM_SAMPLES = 100  # fewer say nothing about noise

_ANCHORS = 2500  # samples at which the fits are compared
_REGION = 70  # anchors over which errors are averaged; over 45 of 1600 the sizes chosen leave steps in surfaces
_SMOOTHING = 18  # anchors over which the chosen neighbourhoods are averaged
_SEEN = 10.0  # a fit shows the noise in full once its radius is this many times its left-out error
_USABLE = 6.0  # and averages it, rather than following it, once its radius is this many times the noise
_STRAY = 4.5  # errors count as at most this many median ones
_FREEDOM = 2.0  # a robust fit follows its samples more than its leverage says
_SAMPLES = 32768  # at a time
_UNEVEN = 2.0  # a region's noise counts as at most this many times the median: two close sheets look like noise

_PATCHES, _PATCH = 16, 300  # patches of a large cloud in which normals are asked, samples in each
_MIDDLE = 100  # of these, those whose neighbours are all there
_SMALLEST_PART = 0.05  # of a cloud that is noisy in parts
_CORE_LEVEL = 0.1  # local spacings: a part's core is above this
_CORE_AGREED = 0.87  # and its normals agree less than this; creases and thin sheets kept above .88
_EVERYWHERE = 0.04  # local spacings: nine tenths of the regions of a noisy cloud are above it
_LEVEL = 0.05  # local spacings: half of them are above this
_GROWTH = 1.15  # from 12 to 20 neighbours noise hardly grows, detail that the samples miss does
_AGREED = 0.96  # median confidence of normals that noise of a tenth of a local spacing does not reach
_SLIGHT = 0.012  # local spacings: nine tenths of the regions of a slightly noisy cloud are above it
_STEADY = 1.05  # from 20 to 32 neighbours slight noise grows less, detail that averaging would blunt more
_TURNED = 2.5  # times the squared level, in local spacings, that slight noise takes off the confidence of normals
_DROWNED = 0.3  # local spacings: above it 12 neighbours see too little of the noise for that comparison
_DETAIL = 1.2  # times that errors grow from 12 to 32 neighbours where averaging would blunt more than noise does
_FLOODED = 0.4  # local spacings: above it noise itself grows so much


@dataclass(frozen=True)
class Noise:
    """Noise at every sample.

    level      : (n,) float64, standard deviation normal to the surface, units of the samples
    neighbours : (n,) float64, size of the neighbourhood over which averaging errs least
    """

    level: np.ndarray
    neighbours: np.ndarray


def looks_noisy(points, spacing, seed: int = 0) -> bool:
    """Whether samples (n,3) with local spacing (n,) are as far off quadrics as noisy ones are; quick, and less
    sure than :func:`noisy_samples`, which asks the normals as well."""
    return len(points) >= MINIMUM_SAMPLES and _roughness(points, spacing, seed, Progress()).whole


def noisy_samples(points, spacing, seed: int = 0, progress=None) -> np.ndarray:
    """(n,) bool: which samples (n,3) with local spacing (n,) are noisy, rather than too few for some of the detail.

    Judged by how far each sample lies off the quadric through its neighbours, in local spacings. Noise looks alike from
    12 and from 20 neighbours; unresolved detail grows. Sheets closer than their samples look like noise to the
    quadrics, but normals agree there from sample to sample, as in no noise.

    A cloud is noisy as a whole where nearly all of it looks so; noise of hundredths of a local spacing, as of rounded
    coordinates, counts where it grows no more up to 32 neighbours, either. Otherwise its noisy parts are those that
    look so around a core that is well above all limits and not small: creases and thin sheets look noisy in places.
    """
    clean = np.zeros(len(points), bool)
    if len(points) < MINIMUM_SAMPLES:
        return clean
    progress = Progress.of(progress)
    found = _roughness(points, spacing, seed, progress)
    relative, anchors, region = found.relative, found.anchors, found.region
    if found.whole:
        agreement = _typical_agreement(points, spacing, seed, progress.part(0.1, 0.3))
        turned = agreement < 1 - _TURNED * np.median(relative) ** 2
        if (found.loud and agreement < _AGREED) or (found.slight and turned):
            return ~clean
    if found.suspect.sum() < _least(anchors):
        return clean

    confidence = _agreement(points, spacing, progress.part(0.3, 0.9))
    agreement = np.median(confidence[anchors][region], axis=1)
    suspect = found.suspect & (agreement < _AGREED)
    core = suspect & (relative > _CORE_LEVEL) & (agreement < _CORE_AGREED)
    if core.sum() < _least(anchors):
        return clean
    suspect &= core[region].any(axis=1)
    noisy = suspect[region[:, :_SMOOTHING]].any(axis=1)  # noise left beside them would stand out as a seam
    return noisy[_nearest(points, points[anchors], progress.part(0.9, 1.0))]


def _typical_agreement(points, spacing, seed, progress):
    """Median confidence of the samples; in a large cloud of those in the middle of some patches of nearest neighbours,
    which is within .011 of it on eight clouds of 5,000 to 20,000, with and without noise."""
    if len(points) <= _PATCHES * _PATCH:
        return np.median(_agreement(points, spacing, progress))
    centres = np.random.default_rng(seed).choice(len(points), _PATCHES, replace=False)
    patch = KDTree(points).query(points[centres], k=_PATCH)[1]
    rows = np.unique(patch)
    confidence = _agreement(points[rows], spacing[rows], progress)
    return np.median(confidence[np.searchsorted(rows, patch[:, :_MIDDLE])])


def _agreement(points, spacing, progress):
    """Confidence (n,) of normals that are not told apart at creases, where those of noise would be as well."""
    mirrors = Mirrors(points, spacing, voronoi_facets(points, spacing, progress=progress.part(0.0, 0.7)))
    return mirrors.confidence(reflection_sweeps(mirrors, progress=progress.part(0.7, 1.0))[0])


@dataclass(frozen=True)
class _Roughness:
    """How far samples lie off quadrics, and where that looks like noise.

    loud, slight : whether the cloud as a whole looks noisy, or may be so by hundredths of a local spacing
    suspect      : (m,) bool, which anchors look noisy     relative : (m,) how far these are off, local spacings
    anchors      : (m,) rows of the samples                region   : (m,k) the anchors nearest to each
    """

    loud: bool
    slight: bool
    suspect: np.ndarray
    relative: np.ndarray
    anchors: np.ndarray
    region: np.ndarray

    @property
    def whole(self) -> bool:
        return self.loud or self.slight


def _roughness(points, spacing, seed, progress):
    anchors, region = _anchors(points, seed)

    def missed(sizes, part):
        fits = nested_quadrics(points, anchors, sizes, part)
        return [GAUSS * np.median(fit.left_out()[region], axis=1) for fit in fits]

    fine, wide = missed(LADDER[:2], progress.part(0.0, 0.08))
    relative = wide / np.median(spacing[anchors][region], axis=1)
    growth = _ratio(wide, fine)
    everywhere, level = np.percentile(relative, (10, 50))
    suspect = _rough(relative, growth)
    loud = everywhere > _EVERYWHERE and _rough(level, np.median(growth))
    slight = everywhere > _SLIGHT and np.median(growth) < _GROWTH
    if loud or slight or suspect.sum() >= _least(anchors):
        (wider,) = missed(LADDER[2:3], progress.part(0.08, 0.1))
        further = _ratio(wider, fine)
        suspect &= ~_detailed(relative, further)
        loud &= not _detailed(level, np.median(further))
        slight &= np.median(_ratio(wider, wide)) < _STEADY
    return _Roughness(bool(loud), bool(slight), suspect, relative, anchors, region)


def _least(anchors):
    """Anchors that the noisy part of a cloud has at least."""
    return max(_REGION, _SMALLEST_PART * len(anchors))


def _ratio(a, b):
    return a / np.maximum(b, np.finfo(float).tiny)


def _rough(relative, growth):
    """Whether errors in local spacings, and their growth from 12 to 20 neighbours, are those of noise."""
    return (relative > _LEVEL) & ((growth < _GROWTH) | (relative > _DROWNED))


def _detailed(relative, further):
    """Whether errors in local spacings grow too much from 12 to 32 neighbours, by the factor `further`, for noise
    alone; those that noise has drowned grow as well."""
    return (further > _DETAIL) & (relative < _FLOODED)


def estimate_noise(points, seed: int = 0, progress=None, noisy=None) -> Noise:
    """Noise level and best neighbourhood of samples (n,3), n > 12; for those marked in `noisy`, (n,) bool, where given.

    A quadric through the k nearest misses the sample that it leaves out by the noise and by what it cannot bend to.
    The level is read off the smallest neighbourhood wide enough to see the noise. The risk of that one and of each
    wider one,

        <h^2> + 2 level^2 <leverage>     (C. Stein, Annals of Statistics 9(6), 1981, up to a constant),

    h being the distance of samples to their quadric, counts the noise left and the detail bent away; every region
    takes the neighbourhood of least risk.
    """
    progress = Progress.of(progress)
    anchors, region = _anchors(points, seed)
    ladder = np.array([k for k in LADDER if k < len(points)])
    fits = nested_quadrics(points, anchors, ladder, progress.part(0.0, 0.9))
    missed = np.array([np.sqrt(_regional_square(fit.left_out(), region)) for fit in fits])
    squared = np.array([_regional_square(fit.height, region) for fit in fits])
    leverage = np.array([np.median(fit.leverage[region], axis=1) for fit in fits])
    radius = np.array([fit.radius for fit in fits])

    every = np.arange(len(anchors))
    first = _first(radius >= _SEEN * missed)
    level = missed[first, every] * np.sqrt(1.0 - leverage[first, every])
    level = np.minimum(level, _UNEVEN * np.median(level if noisy is None else level[noisy[anchors]]))
    risk = squared + 2 * _FREEDOM * level**2 * leverage
    risk[np.arange(len(ladder))[:, None] < _first(radius >= _USABLE * level)] = np.inf
    neighbours = np.exp(np.log(ladder)[risk.argmin(axis=0)][region[:, :_SMOOTHING]].mean(axis=1))

    nearest = _nearest(points, points[anchors], progress.part(0.9, 1.0))
    return Noise(level[nearest], neighbours[nearest])


def _anchors(points, seed):
    """Samples spread over the cloud (m,), and for each the anchors nearest to it, itself first (m,k)."""
    count = min(len(points), _ANCHORS)
    anchors = np.sort(np.random.default_rng(seed).choice(len(points), count, replace=False))
    return anchors, KDTree(points[anchors]).query(points[anchors], k=min(_REGION, count), workers=-1)[1]


def _nearest(points, anchors, progress):
    """Which of the anchors (m,3) is nearest to each of the samples (n,3), (n,) int."""
    tree, nearest = KDTree(anchors), np.empty(len(points), np.int64)
    for part in progress.chunks(len(points), _SAMPLES):
        nearest[part] = tree.query(points[part], workers=-1)[1]
    return nearest


def _first(holds):
    """First rung at which something holds (rungs, m), or the last rung, (m,)."""
    return np.where(holds.any(axis=0), holds.argmax(axis=0), len(holds) - 1)


def _regional_square(error, region):
    """Mean square of errors (m,) over each region, strays held back."""
    error = error[region]
    return np.mean(np.minimum(error, _STRAY * np.median(error, axis=1, keepdims=True)) ** 2, axis=1)
