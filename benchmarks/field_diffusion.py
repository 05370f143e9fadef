"""How far the paper's diffusion on the grid is from its closed form, by the cells that sqrt(t) spans."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from core.field.diffusion import DIFFUSION_LENGTH, fused_axes, kernel_weights
from core.field.grid import PADDING, fit_grid
from core.field.grid_diffusion import FARTHEST, grid_axes
from core.points import local_spacing

from .revolved import Revolved

LENGTHS = 0.3, 0.5, 0.7, 1.0  # cells
COUNTS = 500, 5_000
_MINOR = 0.4  # radius of the torus' tube; that of its ring is 1
_NEAREST = 64
_NODES = 20_000


def agreement() -> Iterator[dict]:
    """Median angle, degrees, between the two forms' axes at random nodes around a torus, true normals given: within two
    local spacings (near), up to FARTHEST sqrt(t) from the points (held), and beyond 1.2 times that (lost; None where
    nothing is)."""
    angle = np.linspace(0, 2 * np.pi, 400)
    torus = Revolved(np.stack([1 + _MINOR * np.cos(angle), _MINOR * np.sin(angle)], axis=1))
    for count in COUNTS:
        points = torus.points(count, np.random.default_rng(0))
        ring = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
        normals = (points - ring) / np.linalg.norm(points - ring, axis=1, keepdims=True)
        spacing = local_spacing(points)
        length = DIFFUSION_LENGTH * np.median(spacing)
        side = (1 + 2 * PADDING) * np.ptp(points, axis=0).max()
        for cells in LENGTHS:
            grid = fit_grid(points, round(cells * side / length))
            angles = _angles(points, normals, spacing, length, grid)
            yield {"points": count, "cells": cells, "resolution": max(grid.shape) - 1, **angles}


def _angles(points, normals, spacing, length, grid):
    axes = grid_axes(points, normals, spacing, grid).reshape(-1, 3)
    node = np.random.default_rng(0).choice(len(axes), min(_NODES, len(axes)), replace=False)
    x = grid.positions(node)
    distance, sample = KDTree(points).query(x, k=_NEAREST, workers=-1)
    height = np.einsum("mki,mki->mk", x[:, None] - points[sample], normals[sample])
    weight, pull = kernel_weights(distance, spacing[sample], height)
    cosine = np.einsum("mi,mi->m", axes[node], fused_axes(weight, pull, np.moveaxis(normals[sample], 2, 0)))
    angle, away = np.degrees(np.arccos(np.clip(cosine, -1, 1))), distance[:, 0] / length
    within = {"near": distance[:, 0] < 2 * np.median(spacing), "held": away < FARTHEST, "lost": away > 1.2 * FARTHEST}
    return {name: float(np.median(angle[chosen])) if chosen.any() else None for name, chosen in within.items()}
