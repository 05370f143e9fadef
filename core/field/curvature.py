"""Bending of the surface at each sample, from its neighbours' positions and normals."""

import numpy as np

from ..linalg import solve_positive
from ..parallel import in_order
from ..progress import Progress

_WIDTH = 1.5  # of the Gaussian weight, local spacings
_ONE_SHEET = 16.0  # how fast samples off each other's plane stop counting
_ALIGNED = 0.5  # least |n_i . n_j| of neighbours that count
_STIFFNESS = 1e-3
_CHUNK = 2048  # samples


def tangent_frames(normals: np.ndarray) -> np.ndarray:
    """Two unit tangents at each sample, (n,3) -> (n,2,3)."""
    helper = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first)], axis=1)


def bending(points, normals, frames, spacing, neighbours, progress=None) -> np.ndarray:
    """Second fundamental forms as tensors B, (n,3,3) float64: the surface near a sample has height l.B.l / 2 above the
    tangent plane at tangential offset l.

    Weighted least squares over the `neighbours` (n,k) of each sample, each giving its height and, through its normal
    turned to agree with the sample's, the slope there (three equations each). Curvatures are limited to one per local
    spacing.
    """
    bend = np.empty((len(points), 3, 3))

    def fit(part):
        return _bending(points, normals, part, frames[part], spacing[part], neighbours[part])

    for part, piece in in_order(fit, Progress.of(progress).chunks(len(points), _CHUNK)):
        bend[part] = piece
    return bend


def _bending(points, normals, rows, frames, spacing, neighbours):
    own = normals[rows]
    step = points[neighbours] - points[rows, None]
    z = np.einsum("nki,ni->nk", step, own)
    x, y = np.moveaxis(np.einsum("nki,nai->nka", step, frames), 2, 0)
    agreement = np.einsum("nki,ni->nk", normals[neighbours], own)
    tilt = np.einsum("nki,nai->nka", normals[neighbours], frames)
    counted = np.abs(agreement) > _ALIGNED
    slope = -tilt / np.where(counted, agreement, 1.0)[..., None]
    squared = np.einsum("nki,nki->nk", step, step)
    height_back = np.einsum("nki,nki->nk", step, normals[neighbours])
    apart = (z**2 + height_back**2) / squared
    decay = squared / (_WIDTH * spacing[:, None]) ** 2 + _ONE_SHEET * apart
    weight = np.where(counted, np.exp(-decay), 0.0)

    zero = np.zeros_like(x)
    distance = np.sqrt(squared)
    equations = (
        (np.stack([x * x, 2 * x * y, y * y], axis=2) / distance[..., None], 2 * z / distance),
        (np.stack([x, y, zero], axis=2), slope[..., 0]),
        (np.stack([zero, x, y], axis=2), slope[..., 1]),
    )
    matrix = _STIFFNESS * (spacing**2)[:, None, None] * np.eye(3)
    right = np.zeros((len(own), 3))
    for row, value in equations:
        weighted = row * weight[..., None]
        matrix = matrix + weighted.transpose(0, 2, 1) @ row
        right += np.einsum("nka,nk->na", weighted, value)
    xx, xy, yy = solve_positive(matrix, right).T

    size = np.sqrt(xx**2 + 2 * xy**2 + yy**2)
    shrink = np.minimum(1.0, 1.0 / np.maximum(size * spacing, np.finfo(float).tiny))
    form = np.stack([np.stack([xx, xy], axis=1), np.stack([xy, yy], axis=1)], axis=1) * shrink[:, None, None]
    return np.einsum("nab,nai,nbj->nij", form, frames, frames)
