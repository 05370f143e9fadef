"""Bending of the surface at each sample, from its neighbours' positions and normals."""

import numpy as np

from ..linalg import dots, row_dots, solve_positive
from ..neighbourhoods.close_sheets import off_sheets
from ..neighbourhoods.cloud import Cloud
from ..parallel import work_through
from ..progress import Progress

_WIDTH = 1.2  # of the Gaussian weight, local spacings
_ONE_SHEET = 16.0  # how fast samples off each other's plane stop counting
_ALIGNED = 0.5  # least |n_i . n_j| of neighbours that count
_STIFFNESS = 1e-3
_CHUNK = 2048  # samples


def bending(cloud: Cloud, room, progress=None) -> np.ndarray:
    """Second fundamental forms as tensors B, (n,3,3) float64: the surface near a sample has height l.B.l / 2 above the
    tangent plane at tangential offset l.

    Weighted least squares over the neighbours of each sample on its sheet, which no other is closer to than `room` (n,)
    float64, each giving its height and, through its normal turned to agree with the sample's, the slope there (three
    equations each). Curvatures are limited to one per local spacing.
    """
    bend = np.empty((len(cloud), 3, 3))
    columns = np.ascontiguousarray(cloud.points.T), np.ascontiguousarray(cloud.normals.T)

    def fit(part):
        bend[part] = _bending(
            *columns, part, cloud.frames[part], cloud.spacing[part], room[part], cloud.neighbours[part]
        )

    work_through(fit, Progress.of(progress).chunks(len(cloud), _CHUNK))
    return bend


def sag(step: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Height above the tangent plane, (...), of patches with second fundamental forms (...,3,3) at steps (...,3) from
    their samples, whose part along the normal does not count."""
    return 0.5 * np.einsum("...i,...ij,...j->...", step, bend, step)


def _bending(points, normals, rows, frames, spacing, room, neighbours):
    """Points and normals component by component, (3,n)."""
    step = [column.take(neighbours) - column[rows, None] for column in points]
    theirs = [column.take(neighbours) for column in normals]
    own, first, second = normals[:, rows, None], *frames.transpose(1, 2, 0)[..., None]
    z, x, y = (dots(step, axis) for axis in (own, first, second))
    agreement = dots(theirs, own)
    counted = (np.abs(agreement) > _ALIGNED) & (off_sheets(step, agreement, z, theirs) < room[:, None])
    along_x, along_y = (dots(theirs, axis) / np.where(counted, -agreement, 1.0) for axis in (first, second))  # slopes
    squared = dots(step, step)
    apart = (z**2 + dots(step, theirs) ** 2) / squared
    decay = squared / (_WIDTH * spacing[:, None]) ** 2 + _ONE_SHEET * apart
    weight = np.where(counted, np.exp(-decay), 0.0)

    # Of B = (xx, xy, yy): (x^2, 2 x y, y^2).B = 2 z, over the distance; (x, y, 0).B and (0, x, y).B are the slopes.
    xx, xy, yy, nearer = x * x, x * y, y * y, weight / squared
    by_xx, by_xy, by_yy = nearer * xx, nearer * xy, nearer * yy
    flat = [row_dots(weight, term) for term in (xx, xy, yy)]
    matrix = np.empty((len(spacing), 3, 3))
    matrix[:, 0, 0] = row_dots(by_xx, xx) + flat[0]
    matrix[:, 0, 1] = matrix[:, 1, 0] = 2 * row_dots(by_xx, xy) + flat[1]
    matrix[:, 0, 2] = matrix[:, 2, 0] = row_dots(by_xx, yy)
    matrix[:, 1, 1] = 4 * row_dots(by_xy, xy) + flat[0] + flat[2]
    matrix[:, 1, 2] = matrix[:, 2, 1] = 2 * row_dots(by_yy, xy) + flat[1]
    matrix[:, 2, 2] = row_dots(by_yy, yy) + flat[2]
    matrix += _STIFFNESS * (spacing**2)[:, None, None] * np.eye(3)
    x, y = weight * x, weight * y
    right = (
        2 * row_dots(by_xx, z) + row_dots(x, along_x),
        4 * row_dots(by_xy, z) + row_dots(y, along_x) + row_dots(x, along_y),
        2 * row_dots(by_yy, z) + row_dots(y, along_y),
    )
    xx, xy, yy = solve_positive(matrix, np.stack(right, axis=1)).T

    size = np.sqrt(xx**2 + 2 * xy**2 + yy**2)
    shrink = np.minimum(1.0, 1.0 / np.maximum(size * spacing, np.finfo(float).tiny))
    form = np.stack([np.stack([xx, xy], axis=1), np.stack([xy, yy], axis=1)], axis=1) * shrink[:, None, None]
    return np.einsum("nab,nai,nbj->nij", form, frames, frames)
