"""Patches of places that lie next to each other: edges of the grid, or lines of a mesh."""

import numpy as np
from scipy.spatial import KDTree

from ...field.grid import Grid
from ...parts import connected_parts

_ADJACENT = 1.8  # cells, edges of one patch


def patches(middle: np.ndarray, grid: Grid, reach: float = _ADJACENT) -> np.ndarray:
    """Number of the patch of each edge of the grid, (m,), by their middles (m,3), or of other places: those of one
    patch are next to each other, within `reach` cells."""
    if not len(middle):
        return np.empty(0, np.int64)
    pairs = KDTree(middle).query_pairs(reach * grid.spacing, output_type="ndarray")
    return connected_parts(*pairs.T, len(middle))


def patch_lengths(patch: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Diagonals of the boxes around the places (m,3) of each patch, which have its number, (m,); one for each patch."""
    order = np.argsort(patch, kind="stable")
    first = np.flatnonzero(np.diff(patch[order], prepend=-1))
    extent = np.maximum.reduceat(place[order], first) - np.minimum.reduceat(place[order], first)
    return np.linalg.norm(extent, axis=1)
