"""How much closer samples lie along the lines that they are on than the lines lie to each other.

The last line before a crease has samples of the other sheet among its nearest, so that it is not recognised as one by
these alone. Most of the samples around are of the same line, and say nothing of how the surface is turned about it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..linalg import medians, row_dots, unit
from ..lookup import mask_of
from ..progress import Progress
from ..trees import k_nearest
from .lines import Lines

_BESIDE = 20  # nearest of a sample on a line, which may be on lines that are not recognised
_AROUND = 64  # whose median tells how far apart lines are, and samples along them
_TRIED = 8  # nearest, two of which are those before and behind on the line
_STRAIGHT = 0.98  # least cosine between the ways there
_FAR = 1.6  # times as far as usual on the lines around, at most, those two are away
_MOST = 8.0  # times as far away as samples along it, is the next line taken to be at most
_CHUNK = 16384  # samples


@dataclass(frozen=True)
class Stretch:
    """along  : (n,3) float64, unit direction of the line that each sample is on, zero on none or without a next
    across : (n,) float64, how far away the next line is, units of the points, zero there
    ratio  : (n,) float64, 1 to 8, of that to the distance to the next sample along the line, 1 there"""

    along: np.ndarray
    across: np.ndarray
    ratio: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, tree: KDTree, step: np.ndarray, lines: Lines, next_line: np.ndarray, progress=None):
        """Of samples (n,3), those of the tree, from the `lines` that some of them are on, how far the `next_line` is
        from these, (n,), zero where there is none, and the distances `step` (n,) to the next sample along them."""
        n, on, progress = len(points), lines.number >= 0, Progress.of(progress)
        beside, own = np.zeros(n, bool), np.flatnonzero(on)
        for part in progress.part(0.0, 0.5).chunks(len(own), _CHUNK):
            beside |= mask_of(k_nearest(tree, points[own[part]], _BESIDE, workers=-1)[1].ravel(), n)
        known = np.where(on & (next_line > 0), next_line, np.nan), np.where(on, step, np.nan)
        along, across, ratio = lines.along.copy(), np.zeros(n), np.ones(n)
        asked = np.flatnonzero(on | beside)
        for part in progress.part(0.5, 1.0).chunks(len(asked), _CHUNK):
            row = asked[part]
            distance, other = k_nearest(tree, points[row], _AROUND, workers=-1)
            apart, usual = (medians(of_each[other]) for of_each in known)
            ahead, rest = step[row], ~on[row]
            along[row[rest]], ahead[rest] = _line_through(points, row[rest], distance[rest], other[rest])
            found = (ahead <= _FAR * usual) & (apart > ahead)
            along[row[~found]] = 0.0
            across[row[found]] = apart[found]
            ratio[row[found]] = np.minimum(apart[found] / ahead[found], _MOST)
        return cls(along, across, ratio)

    def squared_sine(self, row: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """That between the lines of samples `row` (...) and unit directions (...,3), (...): how much a neighbour there
        tells of how the surface is turned about the line. 1 for samples on none."""
        return 1 - row_dots(self.along[row], direction) ** 2

    def nearest(self, row: np.ndarray, points: np.ndarray, tree: KDTree, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Distances (r,k) from samples `row` (r,) to the `count` nearest others, shortened to the side of the line by
        the ratio, and their rows, (r,k), as among samples equally far apart each way; nearest first. They are
        looked for among so many of the nearest as hold them where lines go on to all sides."""
        asked = int(np.ceil(count * self.ratio[row].max())) + 1
        distance, other = k_nearest(tree, points[row], asked)
        distance, other = distance[:, 1:], other[:, 1:]
        ahead = row_dots(points[other] - points[row, None], self.along[row, None]) ** 2
        shortened = ahead + np.maximum(distance**2 - ahead, 0.0) / self.ratio[row, None] ** 2
        first = np.argsort(shortened, axis=1, kind="stable")[:, :count]
        return np.sqrt(np.take_along_axis(shortened, first, axis=1)), np.take_along_axis(other, first, axis=1)


def _line_through(points, row, distance, other):
    """Unit directions (r,3) of the lines that samples `row` (r,) may be on, and the distance to the next sample along
    each, (r,): through the closest two of those around that lie before and behind each, or the nearest alone."""
    distance, other = distance[:, 1 : 1 + _TRIED], other[:, 1 : 1 + _TRIED]
    direction = (points[other] - points[row, None]) / distance[..., None]
    one, two = np.triu_indices(_TRIED, 1)
    both = 0.5 * (distance[:, one] + distance[:, two])
    both[row_dots(direction[:, one], direction[:, two]) > -_STRAIGHT] = np.inf
    every, best = np.arange(len(row)), both.argmin(axis=1)
    through = np.isfinite(both[every, best])
    back = np.where(through[:, None], direction[every, two[best]], 0.0)
    ahead = np.where(through[:, None], direction[every, one[best]], direction[:, 0])
    return unit(ahead - back), np.where(through, both[every, best], distance[:, 0])
