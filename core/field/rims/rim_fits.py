"""Samples beside those at a rim, as seen along it, and the lowest lines over them."""

from dataclasses import dataclass

import numpy as np

from ...neighbourhoods.cloud import Cloud
from .borders import one_sheet

_CONE, _LIFT = 0.8, 0.2  # samples steeper than this above a sample, and further, are across a bay
_STEEPEST = 2.0  # of a line's slope


@dataclass(frozen=True)
class Beside:
    """Samples around some at rims, in lengths given for each of these (its local spacing, for instance).

    other  : (r,k) int, nearest first          along, up : (r,k) float64, along the rim and out of it
    counts : (r,k) bool, whether they are of the sheet and on this side of a bay
    window : (r,) float64, up to where all were looked at
    """

    other: np.ndarray
    along: np.ndarray
    up: np.ndarray
    counts: np.ndarray
    window: np.ndarray

    def outermost(self, window: float, bins: int) -> tuple[np.ndarray, np.ndarray]:
        """Where the highest in each bin of [-window, window] lie, after the own sample at 0, 0: along and up,
        (r,1+bins) each."""
        up = np.where(self.counts, self.up, -np.inf)
        held = np.zeros((len(up), 1 + bins))
        highest = np.full((len(up), 1 + bins), -np.inf)
        highest[:, 0] = 0
        bin_ = 1 + np.clip(((self.along / window + 1) * bins / 2).astype(int), 0, bins - 1)
        order = np.argsort(up, axis=1)
        row = np.broadcast_to(np.arange(len(up))[:, None], order.shape)
        along, up, bin_ = (np.take_along_axis(each, order, axis=1) for each in (self.along, up, bin_))
        held[row, bin_], highest[row, bin_] = along, up  # of one bin the last, which is the highest
        return held, highest


def beside(row, outward, length, cloud: Cloud, window: float, nearest: int) -> Beside:
    """The `nearest` samples around those in `row` (r,) at rims, up to `window` lengths (r,) away; `outward` (r,3)
    unit, out of the sheet."""
    points, normals = cloud.points, cloud.normals
    distance, other = cloud.tree.query(points[row], k=min(nearest, len(cloud)), workers=-1)
    length = length[:, None]
    step = points[other] - points[row, None]
    axes = np.cross(normals[row], outward), outward
    along, up = (np.einsum("rki,ri->rk", step, axis) / length for axis in axes)
    counts = one_sheet(step, normals[row, None], normals[other]) & (distance < window * length)
    counts[:, 0] = True
    counts &= up <= _CONE * np.abs(along) + _LIFT
    return Beside(other, along, up, counts, np.minimum(window, distance[:, -1] / length[:, 0]))


def lowest_lines(along, up, halvings: int) -> tuple[np.ndarray, np.ndarray]:
    """Height over 0 and slope, (r,) each, of the lowest straight lines above points (r,p) that include 0, 0; the
    slope after so many `halvings` of where it may be."""
    low, high = np.full(len(along), -_STEEPEST), np.full(len(along), _STEEPEST)
    every = np.arange(len(along))
    for _ in range(halvings):
        slope = (low + high) / 2
        touched = along[every, (up - slope[:, None] * along).argmax(axis=1)]
        low, high = np.where(touched >= 0, slope, low), np.where(touched <= 0, slope, high)
    slope = (low + high) / 2
    return (up - slope[:, None] * along).max(axis=1), slope
