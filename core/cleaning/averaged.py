"""Means of points: a scan thinned to one sample in each cell of a grid, the mean of those that lay in it.

Where cells part noise of a surface that runs along them, its means lie in two sharp layers, as samples of a thin wall
do; what is nearer than a cell to another sheet cannot be told from that.
"""

import numpy as np
from scipy.spatial import KDTree

from ..trees import k_nearest
from .anchors import some_samples

_LOOKED_AT, _NEAREST = 3000, 8  # samples, and the nearest to each, that are in other cells
_SIDES = 0.6, 1.6  # local spacings: cells of one sample have sides of about one
_WIDEST = 1000.0  # local spacings, how far from one of them the others are; waves to look at grow in number with it
_PER_TURN = 4  # frequencies looked at, for each by which waves over the whole cloud differ by one
_FINER = np.linspace(-1, 1, 81)  # of the step between frequencies
_WAVES = 256  # looked at together
_ROUNDS = 5
_ASIDE = np.linspace(-0.5, 0.5, 33)  # sides, that the cells are moved along each axis
_TOGETHER, _SHIFTED = 0.02, 0.04  # of pairs in one cell at most, and at least where cells are half of one aside


def cells_of_means(points: np.ndarray, spacing: np.ndarray, seed: int = 0) -> float | None:
    """The side of the cells, if each of the samples (n,3) with local spacing (n,) is the mean of the points that lay in
    one cell of a grid along the axes, in the units of both; None where they are no such means.

    Means keep away from the walls of their cells, so their coordinates show a wave of one length along all three axes.
    Cells of that length are placed where the fewest neighbours share one. Hardly any two means share a cell there, and
    many do if the cells are moved aside by half a side. Scattered samples share cells in both places, and those of a
    lattice, which :mod:`.voxels` finds, in neither.
    """
    typical, middle = np.median(spacing), points[some_samples(points, 1, seed)]
    around = points[(np.abs(points - middle) <= _WIDEST * typical).all(axis=1)]
    here = around[some_samples(around, min(_LOOKED_AT, len(around)), seed)]
    step = 1.0 / (_PER_TURN * np.ptp(around, axis=0).max())
    frequency, phase = _wave(here, typical, step)
    near = points[k_nearest(KDTree(points), here, _NEAREST + 1)[1][:, 1:]]
    one, other = np.repeat(here.T, _NEAREST, axis=1), near.reshape(-1, 3).T
    longest = 1.0 / max(frequency - _ROUNDS * step, np.finfo(float).tiny)
    every = np.flatnonzero((np.abs(one - other) < longest).all(axis=0))

    def in_one(side, origin, axes, pairs=every):
        """Those of the pairs that lie in one of cells of a side with a corner at an origin, along some axes."""
        for k in axes:
            pairs = pairs[_cell(one[k, pairs], origin[k], side) == _cell(other[k, pairs], origin[k], side)]
        return pairs

    def together(side, origin):
        return len(in_one(side, origin, range(3))) / one.shape[1]

    middle = here.mean(axis=0)
    side = 1.0 / frequency
    origin = side * (phase - 0.5 + np.rint(middle / side))
    for _ in range(_ROUNDS):
        placed = origin
        for axis in range(3):
            pairs = in_one(side, origin, {0, 1, 2} - {axis})
            moved = [origin, *(origin + aside * side * np.eye(3)[axis] for aside in _ASIDE)]
            origin = min(moved, key=lambda at: len(in_one(side, at, [axis], pairs)))
        longer = [1.0 / (1.0 / side + step * finer) for finer in _FINER]
        resized = [(side, origin), *((new, middle + (origin - middle) * new / side) for new in longer)]
        side, origin = min(resized, key=lambda cells: together(*cells))
        if origin is placed:
            break
    found = together(side, origin) < _TOGETHER and together(side, origin + 0.5 * side) > _SHIFTED
    return side if found else None


def _cell(x, origin, side):
    return np.floor((x - origin) / side)


def _wave(points, spacing, step):
    """The frequency at which points (m,3) have the strongest wave along all three axes, and its phases (3,), turns."""
    least, most = (1.0 / (side * spacing) for side in _SIDES[::-1])
    frequencies = np.arange(least, most, step)
    best = frequencies[np.abs(_waves(points, frequencies)).min(axis=0).argmax()]
    finer = best + step * _FINER
    waves = _waves(points, finer)
    best = np.abs(waves).prod(axis=0).argmax()
    return finer[best], np.angle(waves[:, best]) / (2 * np.pi)


def _waves(points, frequencies):
    """Mean phasors of the coordinates of points (m,3) at each frequency (k,), (3,k) complex."""
    found = np.empty((3, len(frequencies)), complex)
    for first in range(0, len(frequencies), _WAVES):
        some = slice(first, first + _WAVES)
        for axis, x in enumerate(points.T):
            found[axis, some] = np.exp(2j * np.pi * np.outer(frequencies[some], x)).mean(axis=1)
    return found
