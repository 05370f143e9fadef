"""Strays among wires, where samples have no plane that they could be off."""

import numpy as np
from scipy.spatial import KDTree

from ..linalg import row_dots
from .surroundings import Surroundings

_PEERS, _AS_SPARSE, _IN_LINE = 6, 0.5, 3  # nearest samples with this share of a sample's spacing; so many make a line
_STRAIGHT = 0.98  # least cosine to the direction of a line


def off_wires(around: Surroundings, lonely: float) -> np.ndarray:
    """(n,) bool: which samples among wires have a spacing of more than `lonely` times that of their neighbours, are on
    no line of a wire nearby nor in line with samples as sparse, which may be a wire sampled less."""
    found, points = np.zeros(len(around.points), bool), around.points
    row = np.flatnonzero(around.wire & (around.lonely > lonely))
    near = around.neighbours[row, 1:]
    cosine = _cosines(points[row, None] - around.centre[near], around.along[near])
    row = row[~((cosine > _STRAIGHT) & around.curve[near]).any(axis=1)]
    half_octave = np.floor(2 * np.log2(around.spacing[row])) / 2
    for power in np.unique(half_octave):
        own = row[half_octave == power]
        peers = points[around.spacing >= _AS_SPARSE * 2.0**power]
        nearest = KDTree(peers).query(points[own], k=min(_PEERS + 1, len(peers)), workers=-1)[1]
        step = peers[nearest.reshape(len(own), -1)[:, 1:]] - points[own, None]
        lined = (_cosines(step[:, :, None], step[:, None]) > _STRAIGHT).sum(axis=2) >= _IN_LINE
        found[own] = ~lined.any(axis=1)
    return found


def _cosines(a, b):
    """Of the angles between lines along the vectors (...,3) of either; 0 for vectors without a length."""
    squares = row_dots(a, a) * row_dots(b, b)
    product = np.abs(row_dots(a, b))
    return product / np.sqrt(np.maximum(squares, np.finfo(float).tiny))
