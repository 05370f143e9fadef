"""How far foot points lie outside the patches of samples: past rims, across creases, or out of a sample's reach."""

from dataclasses import dataclass

import numpy as np

from ..linalg import dots
from .rims.borders import DISC, OPPOSITE, Rims

_STEEPEST = 0.999  # change of a margin along an edge, where one disc holds the other
_TINY = np.finfo(np.float32).tiny


@dataclass(frozen=True)
class Patches:
    """Where the patches of samples end, as :class:`Rims` says, component by component and in single precision.

    gap, bridged, creased  : (n,) bool; the last where a crease lies beside the sample
    outward                : (3,n)                 opening, reach, behind : (n,)
    ends                   : (2,3,n)               margin                 : (3,n)
    crease                 : (2,3,n)               limit                  : (2,n)
    """

    gap: np.ndarray
    bridged: np.ndarray
    creased: np.ndarray
    outward: np.ndarray
    opening: np.ndarray
    reach: np.ndarray
    behind: np.ndarray
    ends: np.ndarray
    margin: np.ndarray
    crease: np.ndarray
    limit: np.ndarray

    @classmethod
    def of(cls, rims: Rims) -> "Patches":
        arrays = rims.outward, rims.opening, rims.reach, rims.behind, rims.ends, rims.margin, rims.crease, rims.limit
        columns = (np.ascontiguousarray(np.moveaxis(array, 0, -1), np.float32) for array in arrays)
        return cls(rims.gap, rims.bridged, np.isfinite(rims.limit[:, 0]), *columns)

    def excess(self, sample, lateral, spacing) -> tuple[np.ndarray, np.ndarray]:
        """How far foot points lie outside the patches of given samples, along the tangent plane.

        sample : (m,k) int     lateral : (3,m,k) tangential offset from the sample     spacing : (m,k) of the sample
        Returns the distance (m,k) to the patch and the step (3,m,k) that leads out of it (its length is the distance),
        both of the type of `lateral`.
        """
        length = np.sqrt(dots(lateral, lateral))
        own, flat = sample.reshape(-1), lateral.reshape(3, -1)
        radius, past_rim, rim = self._covered(own, flat, length.reshape(-1), DISC * spacing.reshape(-1))
        beyond = np.maximum(length - radius.reshape(length.shape), 0)
        step = lateral * (beyond / np.maximum(length, _TINY))
        _replace_where_worse(beyond, step, rim, *past_rim)
        _replace_where_worse(beyond, step, *self._across_creases(own, flat))
        return beyond, step

    def _covered(self, own, flat, length, radius):
        """How far the patches reach in the direction of each foot point, (p,); and how far out of rims those are that
        lie past one, the steps there, and which these are."""
        row = np.flatnonzero(self.gap.take(own))
        owner, at, away = own.take(row), flat.take(row, axis=1), length.take(row)
        along = dots(at, self.outward.take(owner, axis=1))
        open_side, bridged = along > away * self.opening.take(owner), self.bridged.take(owner)
        covered = np.where(open_side, np.maximum(self.reach.take(owner), radius.take(row)), radius.take(row))
        opposite = along < -OPPOSITE * away
        radius[row] = np.where(opposite, np.maximum(covered, self.behind.take(owner)), covered)
        rim = np.flatnonzero(open_side & ~bridged)
        owner = owner.take(rim)
        return radius, _past_edges(at.take(rim, axis=1), self.ends.take(owner, 2), self.margin.take(owner, 1)), row[rim]

    def _across_creases(self, own, flat):
        """Which foot points lie across a crease, how far, and the steps there."""
        row = np.flatnonzero(self.creased.take(own))
        owner, at = own.take(row), flat.take(row, axis=1)
        toward, limit = self.crease.take(owner, axis=2), self.limit.take(owner, axis=1)
        across = [np.maximum(dots(at, way) - least, 0) for way, least in zip(toward, limit, strict=True)]
        chosen = np.flatnonzero((across[0] > 0) | (across[1] > 0))
        step = sum(far.take(chosen) * way.take(chosen, axis=1) for far, way in zip(across, toward, strict=True))
        return row[chosen], np.sqrt(dots(step, step)), step


def _past_edges(lateral, ends, margin):
    """Of the two segments [0, end], with ends (2,3,p), whose margins (3,p) change along them evenly, the one that
    `lateral` (3,p) is least far out of the margin of: how far out, and the step (3,p) out of it.

    The distance to the discs around a segment, of radius r0 + k t at t along it, is least d k / sqrt(1 - k^2) past the
    foot of the perpendicular, of length d.
    """
    found = []
    for end, last in zip(ends, margin[1:], strict=True):
        squared = np.maximum(dots(end, end), _TINY)
        along = dots(lateral, end)
        length = np.sqrt(squared)
        away = np.sqrt(np.maximum(dots(lateral, lateral) - along**2 / squared, 0))
        taper = np.clip((last - margin[0]) / length, -_STEEPEST, _STEEPEST)
        share = np.clip((along / length + away * taper / np.sqrt(1 - taper**2)) / length, 0, 1)
        step = lateral - share * end
        length = np.sqrt(dots(step, step))
        found.append((length - (1 - share) * margin[0] - share * last, length, step))
    first = found[0][0] <= found[1][0]
    past, length, step = (np.where(first, *pair) for pair in zip(*found, strict=True))
    past = np.maximum(past, 0)
    return past, step * (past / np.where(past > 0, length, 1))


def _replace_where_worse(beyond, step, place, distance, way):
    """Put larger distances (p,) and their steps (3,p) at the flat indices `place` (p,), in place."""
    flat = beyond.reshape(-1)
    worse = np.flatnonzero(distance > flat.take(place))
    place = place.take(worse)
    flat[place] = distance.take(worse)
    for column, found in zip(step.reshape(3, -1), way, strict=True):
        column[place] = found.take(worse)
