"""Corners of borders, told apart from the zigzag that random samples leave by straight lines along longer stretches."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ...linalg import row_dots
from ...lookup import mask_of

_FROM, _TO = 0.5, 3.0  # local spacings from a vertex, between which a line is laid along the border on either side
_TURN = 1.0  # radians, least angle between both lines at a corner
_APART = 1.5  # local spacings along the border, within which there is one corner
_WHOLE = 0.8  # of the way that a line is laid over, which the border must go on
_STEPS = 128  # vertices to either side, at most
_SHARPEST = 1e-6  # squared sine of the angle between lines, below which they do not meet
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Border:
    """The borders of a mesh.

    vertices : (v,3) float64, of the mesh     loop : (l,) int, those with two border edges each
    beside   : (l,2) int, the vertices before and after these
    """

    vertices: np.ndarray
    loop: np.ndarray
    beside: np.ndarray

    def corners(self, spacing: np.ndarray) -> np.ndarray:
        """Which are corners, (l,) bool: of the vertices where the border turns by 57 degrees or more, and most around,
        the ones nearest to where the lines along either side meet; by the local spacing (l,) there."""
        (one, p), (other, q) = (self._line(side, spacing) for side in range(2))
        both = one.any(axis=1) & other.any(axis=1)
        turn = np.where(both, np.arccos(np.clip(-row_dots(one, other), -1, 1)), 0.0)
        around = np.array([row for side in range(2) for _, _, row, _, _ in self._walk(side, _APART * spacing)])
        most = np.where(around >= 0, turn[around], 0.0).max(axis=0)
        peak = np.flatnonzero((turn >= _TURN) & (turn >= most))
        among = np.concatenate([peak[None], around[:, peak]])
        away = self.vertices[self.loop[among]] - _where_lines_meet(p[peak], one[peak], q[peak], other[peak])
        nearest = np.where(among >= 0, row_dots(away, away), np.inf).argmin(axis=0)
        return mask_of(among[nearest, np.arange(len(peak))], len(self.loop))

    def within(self, reach: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """Which are `chosen` (l,) bool, or have one that is within `reach` (l,) along the border, (l,) bool."""
        found = chosen.copy()
        for side in range(2):
            for _, further, row, _, _ in self._walk(side, reach):
                found |= (row >= 0) & (further <= reach) & chosen[row]
        return found

    @cached_property
    def _number(self):
        """Which of `loop` each vertex is, (v,) int; -1 for others."""
        number = np.full(len(self.vertices), -1)
        number[self.loop] = np.arange(len(self.loop))
        return number

    def _line(self, side, spacing):
        """Unit directions (l,3) of the border to one side, from the middle of the nearer half of a stretch to that of
        the farther, zero where the border ends on the way; and points on these lines, (l,3)."""
        ends = np.linspace(_FROM, _TO, 3)[:, None] * spacing
        total, length, gone = np.zeros((2, len(spacing), 3)), np.zeros((2, len(spacing))), 0.0
        for walked, further, _, start, stop in self._walk(side, ends[-1]):
            for half, (first, last) in enumerate(pairwise(ends)):
                begin, end = np.clip(walked, first, last), np.clip(further, first, last)
                size, part = further - walked, end - begin
                share = np.clip(0.5 * (begin + end) - walked, 0, size) / np.maximum(size, _TINY)
                total[half] += part[:, None] * (start + share[:, None] * (stop - start))
                length[half] += part
            gone = further
        near, far = total / np.maximum(length, _TINY)[..., None]
        way = far - near
        size = np.where(gone > _WHOLE * ends[-1], np.linalg.norm(way, axis=1), np.inf)
        return way / np.maximum(size, _TINY)[:, None], 0.5 * (near + far)

    def _walk(self, side, reach):
        """From each vertex to one side, vertex by vertex, until it has gone as far as `reach` (l,) or comes to where
        borders end or touch: how far before and after each step, (l,) each, alike once it is there; which of `loop` is
        reached, (l,), -1 for none; and the ends of the step, (l,3) each."""
        before, at = self.loop, self.beside[:, side]
        walked, going = np.zeros(len(at)), np.ones(len(at), bool)
        for _ in range(_STEPS):
            start, stop = self.vertices[before], self.vertices[at]
            further = walked + going * np.linalg.norm(stop - start, axis=1)
            row = np.where(going, self._number[at], -1)
            yield walked, further, row, start, stop
            walked, going = further, (row >= 0) & (further < reach)
            if not going.any():
                return
            ends = self.beside[row]
            on = np.where(ends[:, 0] == before, ends[:, 1], ends[:, 0])
            before, at = np.where(going, at, before), np.where(going, on, at)


def _where_lines_meet(p, a, q, b):
    """The middles of the shortest links between lines through p and q (m,3) in unit directions a and b (m,3), (m,3)."""
    between, cosine = q - p, row_dots(a, b)
    along, back = row_dots(between, a), row_dots(between, b)
    scale = np.maximum(1 - cosine**2, _SHARPEST)
    s, t = (along - cosine * back) / scale, (cosine * along - back) / scale
    return 0.5 * (p + s[:, None] * a + q + t[:, None] * b)
