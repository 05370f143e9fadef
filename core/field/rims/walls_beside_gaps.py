"""Walls beside gaps: what lies between two samples of a sheet is open where the sheet turns away between them.

A drilled hole or the slot between two teeth leaves a gap in the face around it that may be as narrow as chance leaves
gaps between samples. But there the surface goes on down the sides of the hole: beside the gap, samples face it.
"""

import numpy as np

from ...linalg import row_dots
from ...neighbourhoods.cloud import Cloud

_STEEP = 0.6  # largest |n_i . n_j| of a wall's samples
_FACING = 0.5  # least cosine between their normals and the way across
_BEFORE, _ASIDE, _UP = 0.2, 1.5, 2.0  # local spacings from the sample that the wall may lie behind, beside or above it
_CROSSES = 0.3  # local spacings, that the samples of a sheet which crosses that of the gap lie off it on both sides


def walled(row, other, cloud: Cloud) -> np.ndarray:
    """Whether a wall stands between samples `row` and `other` (m,), next to either, (m,) bool."""
    return _wall_next_to(row, other, cloud) | _wall_next_to(other, row, cloud)


def _wall_next_to(row, other, cloud):
    points, normals, near = cloud.points, cloud.normals, cloud.neighbours[row]
    way = points[other] - points[row]
    width, size = np.linalg.norm(way, axis=1)[:, None], cloud.spacing[row, None]
    way /= width
    step, theirs = points[near] - points[row, None], normals[near]
    along, up = (np.einsum("mki,mi->mk", step, axis) for axis in (way, normals[row]))
    aside = np.sqrt(np.maximum(row_dots(step, step) - along**2 - up**2, 0))
    facing = np.einsum("mki,mi->mk", theirs, way)
    wall = (np.abs(facing) > _FACING) & (np.abs(np.einsum("mki,mi->mk", theirs, normals[row])) < _STEEP)
    crossing = row_dots(step, theirs) / np.where(wall, facing, 1)  # of its plane and the way
    wall &= (crossing > -_BEFORE * size) & (np.maximum(crossing, along) < width)
    wall &= (aside < _ASIDE * size) & (np.abs(up) < _UP * size)
    above, below = ((wall & (side * up > _CROSSES * size)).any(axis=1) for side in (1, -1))
    return wall.any(axis=1) & ~(above & below)
