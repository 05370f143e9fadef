"""Voxels: samples on a lattice hardly finer than they are dense, each off the surface by up to half of a step.

What a scan that was binned, a segmented volume or a grid of occupied cells leaves has more noise than any rounding, but
in layers, which look like thin walls or flat faces, or in terraces wider than the neighbours that noise is seen in.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import numpy as np
from scipy.spatial import KDTree

from ..linalg import unit
from ..lookup import is_among
from ..points import SPACING_NEIGHBOURS
from ..trees import k_nearest
from .anchors import some_samples

_LOOKED_AT, _NEAREST = 300, 8  # samples, and the nearest to each, whose offsets are looked at
_INDEPENDENT = 0.1  # volume over that of a right-angled box, at least, of offsets that span a lattice
_WHOLE = 0.02  # steps, that an offset is off whole numbers of them, at most
_MOST = 0.9  # of the offsets, at least, are no further off; strays have others
_TWINS, _ALIKE = 5, 1e-3  # others, at least, that are like an offset that spans the lattice, to this share of a length
_COARSE = 0.25  # local spacings, the side at least
_STEPS = np.eye(3, dtype=int)  # over the faces of a voxel
_NUMBERED = np.array([1, 1 << 21, 1 << 42])  # times places: one number for each, two million on a side
_ROUNDED = 1 / np.sqrt(12)  # standard deviation of errors that are uniform over a step


@dataclass(frozen=True)
class Voxels:
    """The voxels that samples are the centres or corners of, in whatever turn.

    edges : (3,3) float64, the vectors along them     place : (n,3) int64, of the samples, in edges
    """

    edges: np.ndarray
    place: np.ndarray

    @cached_property
    def side(self) -> float:
        """The length of the edge along which samples are off the surface: of the longest, or where no two samples are
        above each other along one edge, of that: in a grid of heights these alone are rounded."""
        length = np.linalg.norm(self.edges, axis=1)
        above = [len(np.unique(np.delete(self.place, k, axis=1) @ _NUMBERED[:2])) for k in range(3)]
        return float(length[np.argmax(above)] if max(above) == len(self.place) else length.max())

    @property
    def noise(self) -> float:
        """Standard deviation of the samples."""
        return _ROUNDED * self.side

    def stairs(self, rows) -> np.ndarray:
        """Which of the samples `rows` (m,) have another beside an edge of their voxel, but none beside the faces that
        this edge is between, (m,) bool: where terraces end that a surface between the voxels leaves. Boxes, and
        surfaces that go through voxels, have hardly any."""
        own, found = self.place[rows], np.zeros(len(rows), bool)
        for one, other in combinations(_STEPS, 2):
            for a, b in product((-one, one), (-other, other)):
                found |= self._taken(own + a + b) & ~self._taken(own + a) & ~self._taken(own + b)
        return found

    def inside(self) -> np.ndarray:
        """Which samples have others beside all six faces of their voxel, (n,) bool."""
        found = np.ones(len(self.place), bool)
        for step in (*_STEPS, *-_STEPS):
            found[found] = self._taken(self.place[found] + step)
        return found

    def _taken(self, place):
        """Which of some places (m,3) samples have, (m,) bool."""
        return is_among(place @ _NUMBERED, self._numbers)

    @cached_property
    def _numbers(self):
        return np.sort(self.place @ _NUMBERED)


def find_voxels(points, seed: int = 0) -> Voxels | None:
    """The voxels that samples (n,3), n > 1, are the centres or corners of; None where they are of none, or of voxels
    smaller than a quarter of their local spacing.

    The three shortest offsets between neighbours that are independent, and recur, span the lattice that samples lie on,
    if they lie on any; then the other offsets are whole numbers of them.
    """
    rows = some_samples(points, min(_LOOKED_AT, len(points)), seed)
    beside = k_nearest(KDTree(points), points[rows], _NEAREST + 1)[1][:, 1:]
    offset = (points[beside] - points[rows, None]).reshape(-1, 3)
    length = np.linalg.norm(offset, axis=1)
    alike = _ALIKE * np.median(length)
    twins = np.isfinite(KDTree(offset).query(offset, k=[_TWINS + 1], distance_upper_bound=alike, workers=-1)[0][:, 0])
    edges = _shortest_independent(offset[twins][np.argsort(length[twins], kind="stable")])
    if edges is None:
        return None
    for i, j in combinations(range(3), 2):
        edges[j] -= np.rint(edges[i] @ edges[j] / (edges[i] @ edges[i])) * edges[i]
    steps = offset @ np.linalg.inv(edges)
    whole = np.rint(steps)
    on = np.abs(steps - whole).max(axis=1) < _WHOLE
    if on.mean() < _MOST:
        return None
    spacing = length.reshape(len(rows), -1)[:, :SPACING_NEIGHBOURS].mean(axis=1)
    edges = np.linalg.lstsq(whole[on], offset[on], rcond=None)[0]
    found = Voxels(edges, np.rint((points - points[0]) @ np.linalg.inv(edges)).astype(np.int64))
    return found if found.side >= _COARSE * np.median(spacing) else None


def _shortest_independent(offset):
    """The first three of vectors (m,3) that are independent, (3,3); None where there are none."""
    if not len(offset):
        return None
    way = unit(offset)
    across = np.cross(way[0], way)
    aside = np.flatnonzero(np.linalg.norm(across, axis=1) > _INDEPENDENT)
    if not len(aside):
        return None
    out = np.flatnonzero(np.abs(way @ across[aside[0]]) > _INDEPENDENT)
    return offset[[0, aside[0], out[0]]] if len(out) else None
