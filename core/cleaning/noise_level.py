"""How noisy the samples are, and over how many neighbours the surface is best averaged, region by region."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..parallel import in_order
from ..progress import Progress
from .anchors import SMOOTHING, nearest_anchor, spread_anchors
from .quadrics import nested_quadrics

LADDER = (12, 20, 32, 50, 80, 128, 200)  # neighbours tried

_SEEN = 10.0  # a fit shows the noise in full once its radius is this many times its left-out error
_USABLE = 6.0  # and averages it, rather than following it, once its radius is this many times the noise
_STRAY = 4.5  # errors count as at most this many median ones
_FREEDOM = 2.0  # a robust fit follows its samples more than its leverage says
_UNEVEN = 2.0  # a region's noise counts as at most this many times the median: two close sheets look like noise


@dataclass(frozen=True)
class Noise:
    """Noise at every sample.

    level      : (n,) float64, standard deviation normal to the surface, units of the samples
    neighbours : (n,) float64, size of the neighbourhood over which averaging errs least
    """

    level: np.ndarray
    neighbours: np.ndarray


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
    anchors, region = spread_anchors(points, seed)
    ladder = np.array([k for k in LADDER if k < len(points)])
    fits = nested_quadrics(points, anchors, ladder, progress.part(0.0, 0.9))
    seen = [errors for _, errors in in_order(partial(_regional_errors, region=region), fits)]
    missed, squared, leverage = (np.array(errors) for errors in zip(*seen, strict=True))
    radius = np.array([fit.radius for fit in fits])

    every = np.arange(len(anchors))
    first = _first(radius >= _SEEN * missed)
    level = missed[first, every] * np.sqrt(1.0 - leverage[first, every])
    level = np.minimum(level, _UNEVEN * np.median(level if noisy is None else level[noisy[anchors]]))
    risk = squared + 2 * _FREEDOM * level**2 * leverage
    risk[np.arange(len(ladder))[:, None] < _first(radius >= _USABLE * level)] = np.inf
    neighbours = np.exp(np.log(ladder)[risk.argmin(axis=0)][region[:, :SMOOTHING]].mean(axis=1))

    nearest = nearest_anchor(points, points[anchors], progress.part(0.9, 1.0))
    return Noise(level[nearest], neighbours[nearest])


def _first(holds):
    """First rung at which something holds (rungs, m), or the last rung, (m,)."""
    return np.where(holds.any(axis=0), holds.argmax(axis=0), len(holds) - 1)


def _regional_errors(fit, region):
    """Of quadrics at the anchors, over the region of each: error of the sample left out, squared height, leverage."""
    missed = np.sqrt(_regional_square(fit.left_out(), region))
    return missed, _regional_square(fit.height, region), np.median(fit.leverage[region], axis=1)


def _regional_square(error, region):
    """Mean square of errors (m,) over each region, strays held back."""
    error = error[region]
    return np.mean(np.minimum(error, _STRAY * np.median(error, axis=1, keepdims=True)) ** 2, axis=1)
