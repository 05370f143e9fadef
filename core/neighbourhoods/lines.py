"""Samples on lines: wires, contours, slices, the lines of a scanner.

Their local spacing is that along the line, and the next line may be many times as far away.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..linalg import outer, principal_axes, row_dots
from ..parts import connected_parts
from ..trees import k_nearest

_NEAREST = 4  # of a sample, that tell whether it is on a line
_SLENDER = 0.0625  # their second moment across the line, of that along it, at most
_MANY, _AROUND = 0.65, 6  # of as many nearest, at least, that are on lines as well
_FEW = 8  # samples, that a line has at least
_NEXT = 1.2  # local spacings, to the next samples of the same line
_ASIDE = 0.5  # sine, at least, of the angle between a line and the way to another one
OTHERS = 64  # samples among which another line is looked for


@dataclass(frozen=True)
class Lines:
    """number : (n,) int, of the line that each sample is on, -1 for others
    along     : (n,3) float64, unit direction of the line there, zero for others"""

    number: np.ndarray
    along: np.ndarray

    def aside(self, own: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """Whether steps (m,k,3) from samples `own` (m,), on lines, lead to the side of these, (m,k) bool."""
        return row_dots(steps, self.along[own, None]) ** 2 < (1 - _ASIDE**2) * row_dots(steps, steps)

    def to_others(self, points: np.ndarray, own: np.ndarray, tree: KDTree) -> np.ndarray:
        """How far from samples `own` (m,), on lines, another line is, or where there is none around, their own to the
        side, (m,); 0 where that is not either. All samples are the `points` (n,3) of the tree."""
        distance, other = k_nearest(tree, points[own], OTHERS, workers=-1)
        aside = self.aside(own, points[other] - points[own, None])
        others = aside & (self.number[other] != self.number[own, None])
        chosen = np.where(others.any(axis=1)[:, None], others, aside)
        return np.where(chosen.any(axis=1), distance[np.arange(len(own)), chosen.argmax(axis=1)], 0.0)


def find_lines(points: np.ndarray, spacing: np.ndarray, nearest: np.ndarray) -> Lines:
    """The lines that samples (n,3) with local spacing (n,) are on, told from their `nearest` (n,k), k of 6 or more:
    where these follow each other in one direction, and so do theirs, and many in a row."""
    n, nearest = len(points), nearest[:, :_AROUND]
    moments = sum(outer(points[other] - points) for other in nearest[:, :_NEAREST].T)
    chosen = _are_slender(moments)
    chosen &= chosen[nearest].mean(axis=1) >= _MANY
    own, along = np.flatnonzero(chosen), np.zeros((n, 3))
    away = np.linalg.norm(points[nearest[own]] - points[own, None], axis=2)
    row, column = np.nonzero((away <= _NEXT * spacing[own, None]) & chosen[nearest[own]])
    number = connected_parts(own[row], nearest[own[row], column], n)
    chosen &= np.bincount(number[own], minlength=n)[number] >= _FEW
    along[chosen] = principal_axes(moments[chosen])
    return Lines(np.where(chosen, number, -1), along)


def _are_slender(moments):
    """Whether second moments (m,6) have one large principal value alone, (m,) bool, by their sum and that of their
    products."""
    xx, yy, zz, xy, xz, yz = moments.T
    products = xx * yy + yy * zz + zz * xx - xy**2 - xz**2 - yz**2
    return products <= _SLENDER * (xx + yy + zz) ** 2
