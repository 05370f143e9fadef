"""How noisy the samples are, and over how many neighbours the surface is best averaged, region by region."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..neighbourhoods.clusters import Clusters
from ..neighbourhoods.quadrics import fit_quadrics, nested_quadrics
from ..parallel import in_order
from ..progress import Progress
from .anchors import SMOOTHING, nearest_anchor, spread_anchors

LADDER = (12, 20, 32, 50, 80, 128, 200)  # neighbours tried
_WIDER = (320, 500, 800, 1250, 2000, 3200, 5000, 8000, 12500, 20000)  # tried one by one, where noise asks for more
_ASKED = 0.1  # share of the regions that the widest of them serves best, above which a wider one is tried
_PART, _MOST = 0.025, 0.1  # of the cloud, that these hold at most, as more see the shape; and where noise drowns that
_WRAPPED = 0.97, 1.3  # times the level seen in the one before, outside of which they reach round the shape

_SEEN = 10.0  # a fit shows nearly all of the noise once its radius is this many times its left-out error
_USABLE = 6.0  # and most of it, well enough to tell the rest, once its radius is this many times the noise
_LEAST = 4.0  # a narrower one follows more of it than is known
_FOLLOWED = 1.47, 1.5, 0.5  # scale, power and most of the share they follow: within .03 on planes by 50 to 2000 samples
_ROUNDS = 10  # after which level and share agree
_STRAY = 4.5  # errors count as at most this many median ones
_FREEDOM = 3.0  # a robust fit follows its samples more than its leverage says
_UNEVEN = 2.0  # a region's noise counts as at most this many times the median: two close sheets look like noise


@dataclass(frozen=True)
class Noise:
    """Noise at every sample.

    level      : (n,) float64, standard deviation normal to the surface, units of the samples
    neighbours : (n,) float64, size of the neighbourhood over which averaging errs least
    """

    level: np.ndarray
    neighbours: np.ndarray


def estimate_noise(points, seed: int = 0, progress=None, noisy=None, least: float = 0.0) -> Noise:
    """Noise level and best neighbourhood of samples (n,3), n > 12.

    noisy : (n,) bool, samples that say which level is typical, or None for all
    least : level that is known to be there, units of the samples: neighbourhoods as small as the terraces of voxels see
            less of it

    A quadric through the k nearest, within a radius r, misses the sample that it leaves out by the noise, but for the
    share f = (1.47 level / r)^1.5 that it follows, and by what it cannot bend to. The level is read off the smallest
    neighbourhood wide enough to see most of the noise. The rest of the square of what a fit misses is what it cannot
    bend to; this may come out negative, as only its growth tells, unless the level is the least. Every region takes the
    neighbourhood of least risk, the squared error that is expected of its quadric (after C. Stein, Annals of Statistics
    9(6), 1981):

        bent^2 + level^2 (3 <leverage> + f^2)
    """
    progress = Progress.of(progress)
    anchors, region = spread_anchors(points, seed)
    counted = np.ones(len(anchors), bool) if noisy is None else noisy[anchors]
    sizes, clusters = [k for k in LADDER if k < len(points)], Clusters(points)
    fits = nested_quadrics(points, anchors, sizes, progress.part(0.0, 0.6))
    seen = [errors for _, errors in in_order(partial(_regional_errors, region=region), fits)]
    level, best, drowned = _of_least_risk(seen, counted, least)
    for k, part in progress.part(0.6, 0.9).turns(_WIDER):
        if (best == len(seen) - 1).mean() < _ASKED or k > (_MOST if drowned else _PART) * len(points):
            break
        seen.append(_regional_errors(fit_quadrics(points, anchors, k, part, clusters), region))
        sizes.append(k)
        level, best, drowned = _of_least_risk(seen, counted, least)
    neighbours = np.exp(np.log(sizes)[best][region[:, :SMOOTHING]].mean(axis=1))

    nearest = nearest_anchor(points, points[anchors], progress.part(0.9, 1.0))
    return Noise(level[nearest], neighbours[nearest])


def _of_least_risk(seen, counted, least):
    """Level of each region, the `least` or more, and its neighbourhood of least risk, (m,), from the errors of each
    neighbourhood; some of the regions are `counted`, (m,) bool, for the typical level."""
    missed, leverage, radius = np.moveaxis(np.array(seen), 1, 0)
    levels = missed * np.sqrt(1.0 - leverage)
    sound = _before_wrapping(levels)
    last = sound.sum(axis=0) - 1
    level = in_full(levels, radius, _first(sound & (radius >= _SEEN * missed), last))
    level = np.minimum(level, in_full(levels, radius, _first(sound & (radius >= _USABLE * level), last)))
    level = np.maximum(np.minimum(level, _UNEVEN * np.median(level[counted])), least)
    followed = _followed(level, radius)
    bent = levels**2 - (level * (1 - followed)) ** 2
    bent[:, level == least] = np.maximum(bent[:, level == least], 0.0)
    risk = bent + level**2 * (_FREEDOM * leverage + followed**2)
    narrow = np.arange(len(seen))[:, None] < _first(sound & (radius >= _LEAST * level), last)
    risk[narrow | ~sound] = np.inf
    return level, risk.argmin(axis=0), (radius[-1] < _USABLE * level).mean() > 0.5


def in_full(levels, radius, rung):
    """The noise (m,) of which quadrics show the levels (k,m) that neighbourhoods of number `rung` (m,) see."""
    seen, radius = (np.take_along_axis(each, rung[None], axis=0)[0] for each in (levels, radius))
    level = seen
    for _ in range(_ROUNDS):
        level = seen / (1 - _followed(level, radius))
    return level


def _followed(level, radius):
    """Share of noise of a level that quadrics of a radius follow."""
    scale, power, most = _FOLLOWED
    return np.minimum((scale * level / radius) ** power, most)


def _before_wrapping(levels):
    """Which neighbourhoods see a part of the shape alone, (k,m) bool, by the levels seen in each: all of the ladder,
    and the wider ones up to that where the level jumps, or falls, as quadrics reach over to another part and turn."""
    least, most = _WRAPPED
    growth = levels[1:] / np.maximum(levels[:-1], np.finfo(float).tiny)
    wraps = (growth < least) | (growth > most)
    wraps[: len(LADDER) - 1] = False
    return np.concatenate([np.ones((1, levels.shape[1]), bool), ~np.logical_or.accumulate(wraps, axis=0)])


def _first(holds, last):
    """First rung at which something holds (rungs, m), or the `last`, (m,)."""
    return np.where(holds.any(axis=0), holds.argmax(axis=0), last)


def _regional_errors(fit, region):
    """Of quadrics at the anchors, over the region of each: error of the sample left out, root mean square with strays
    held back; typical leverage and radius; (3,m)."""
    error = fit.left_out()[region]
    error = np.minimum(error, _STRAY * np.median(error, axis=1, keepdims=True))
    missed = np.sqrt(np.mean(error**2, axis=1))
    return np.stack([missed, np.median(fit.leverage[region], axis=1), np.median(fit.radius[region], axis=1)])
