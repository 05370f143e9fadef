"""Gaps in the sampling at rims, told apart from bays.

Random samples leave gaps at rims as they do inside (`sampling_gaps`), and a line that is bent where it saves area
follows them inwards. Around a bay the rim bends; beside a gap of chance it goes on straight on both sides. So a line is
laid over the samples of a long stretch of rim. Where no bent one would leave much less area below it, samples on it are
far apart somewhere, and the area between is no more than chance leaves empty among as many samples, that line is the
rim of those in between.
"""

from dataclasses import dataclass

import numpy as np

from ...linalg import row_dots
from ...lookup import least_of_each
from ...neighbourhoods.cloud import Cloud
from ...parallel import in_order
from ...progress import Progress
from ...trees import k_nearest
from .borders import one_sheet
from .rim_fits import Beside, beside, lowest_lines
from .sampling_gaps import largest_empty_area

_WINDOW = 11.0  # usual spacings to either side of a sample, how far its line looks
_NEAREST = 260  # samples, how many it looks at
_BINS = 22  # of the window; each keeps its outermost sample
_HALVINGS = 11  # to find a line's slope
_USUAL = 32  # samples around, whose median spacing is the usual one
_RANDOM = 0.62  # largest median distance to the nearest sample, local spacings: .5 at random, .78 of blue noise
_BENDS = -0.1, -0.04, -0.02, -0.01, -0.005, 0.005, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2  # quadratic, that are tried
_SAVED = 5.0  # squared usual spacings, that a bent line may save of the area below a straight one
_ON = 0.5  # usual spacings below the line, where samples still lie on it
_SHALLOW, _DEEP = 0.3, 3.0  # usual spacings, that those in a gap lie below it
_CHANCE = 0.01  # gaps of the largest area that are expected among as many samples at rims
_AHEAD, _ASKED = 0.8, 12  # of the depth, where samples of other sheets are looked for, and among how many
_CHUNK = 128  # rim samples


@dataclass(frozen=True)
class RimGaps:
    """Samples at rims that lie in gaps of the sampling.

    of    : (g,) int, their numbers among those at rims
    up    : (g,3) float64, unit, across the rim there
    depth : (g,) float64, how far from it they lie
    """

    of: np.ndarray
    up: np.ndarray
    depth: np.ndarray


def spacing_around(row, cloud: Cloud) -> tuple[np.ndarray, np.ndarray]:
    """The usual spacing around samples in `row` (r,), the median of the nearest 32, and whether these lie at random,
    (r,) bool, rather than evenly spaced."""
    points, spacing = cloud.points, cloud.spacing
    near = k_nearest(cloud.tree, points[row], _USUAL, workers=-1)[1]
    some, at = np.unique(near, return_inverse=True)
    nearest = cloud.tree.query(points[some], k=[2], workers=-1)[0][:, 0] / spacing[some]
    at_random = np.median(nearest[at.reshape(near.shape)], axis=1) <= _RANDOM
    return np.median(spacing[near], axis=1), at_random


def find_rim_gaps(row, outward, usual, at_random, cloud: Cloud, progress=None) -> RimGaps:
    """Which samples at rims, `row` (r,) with ways out of the sheet (r,3), lie in gaps of the sampling.

    usual, at_random : (r,), see :func:`spacing_around`
    """
    normals, random = cloud.normals, np.flatnonzero(at_random)
    number = np.full(len(cloud), -1)
    number[row] = np.arange(len(row))
    most = largest_empty_area(len(row), _CHANCE)

    def look(part):
        line = random[part]
        around = beside(row[line], outward[line], usual[line], cloud, _WINDOW, _NEAREST)
        straight, slope = _straight_lines(around)
        at, column, depth, on = _below_lines(around, straight, slope, most)
        gap = number[around.other[at, column]]
        at, gap, depth, on = (each[gap >= 0] for each in (at, gap, depth, on))
        of = line[at]
        across = outward[of] - slope[at, None] * np.cross(normals[row[of]], outward[of])
        return gap, across, depth * usual[of], on

    chunks = Progress.of(progress).chunks(len(random), _CHUNK)
    found = [gaps for _, gaps in in_order(look, chunks)] or [(np.empty(0, int), np.empty((0, 3)), *np.empty((2, 0)))]
    gap, across, depth, on = (np.concatenate(each) for each in zip(*found, strict=True))
    best = least_of_each(gap, -on, depth)
    gap, across, depth = gap[best], across[best], depth[best]
    own = normals[row[gap]]
    up = across - row_dots(across, own)[:, None] * own
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    free = _nothing_ahead(row[gap], up, depth, cloud)
    return RimGaps(gap[free], up[free], depth[free])


def _nothing_ahead(row, up, depth, cloud):
    """Whether no samples of other sheets lie around the rim that samples `row` (g,) are `depth` (g,) off, (g,) bool:
    where sheets meet or run close, a sheet goes on behind them."""
    points, normals, place = cloud.points, cloud.normals, cloud.points[row] + _AHEAD * depth[:, None] * up
    distance, other = cloud.tree.query(place, k=min(_ASKED, len(cloud)), workers=-1)
    step = points[other] - points[row, None]
    own = one_sheet(step, normals[row, None], normals[other]) | (other == row[:, None])
    return (own | (distance > depth[:, None])).all(axis=1)


def _straight_lines(around: Beside):
    """Heights of the lowest straight lines, -inf where a bent one saves much of the area, and their slopes, (r,)."""
    along, up = around.outermost(_WINDOW, _BINS)
    straight, slope = lowest_lines(along, up, _HALVINGS)
    for bend in _BENDS:
        height, _ = lowest_lines(along, up - bend * along**2, _HALVINGS)
        saved = 2 * around.window * (straight - height - bend * around.window**2 / 3)
        straight = np.where(saved < _SAVED, straight, -np.inf)
    return straight, slope


def _below_lines(around: Beside, height, slope, most):
    """Samples that lie in gaps of no more than the area `most` below lines of heights and slopes (r,): which line and
    column, how far below it, and how many samples lie on it, (g,) each."""
    root = np.sqrt(1 + slope**2)[:, None]
    along = (around.along + slope[:, None] * around.up) / root
    below = (height[:, None] + slope[:, None] * around.along - around.up) / root
    order = np.argsort(np.where(around.counts, along, np.inf), axis=1)
    along, below, counts = (np.take_along_axis(each, order, axis=1) for each in (along, below, around.counts))
    on = counts & (below < _ON)
    before = np.maximum.accumulate(np.where(on, along, -np.inf), axis=1)
    behind = np.minimum.accumulate(np.where(on, along, np.inf)[:, ::-1], axis=1)[:, ::-1]

    bins = np.clip(np.floor(along + _WINDOW).astype(int), 0, int(2 * _WINDOW) - 1)
    line = np.broadcast_to(np.arange(len(along))[:, None], along.shape)
    depth = np.full((len(along), int(2 * _WINDOW)), _DEEP)
    np.minimum.at(depth, (line[counts], bins[counts]), np.maximum(below, 0)[counts])
    area = np.cumsum(np.pad(depth, ((0, 0), (1, 0))), axis=1)
    first, last = (np.clip(np.round(end + _WINDOW), 0, 2 * _WINDOW).astype(int) for end in (before, behind))
    empty = np.take_along_axis(area, last, axis=1) - np.take_along_axis(area, first, axis=1)

    inside = counts & (below > _SHALLOW) & (below < _DEEP) & np.isfinite(before) & np.isfinite(behind)
    at, column = np.nonzero(inside & (empty < most))
    return at, order[at, column], below[at, column], on.sum(axis=1)[at]
