"""The grid's diffusion against the closed-form kernels, and where it has to give up."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Settings, SettingsError, reconstruct
from core.field.diffusion import DIFFUSION_LENGTH, fused_axes, kernel_weights
from core.field.grid import fit_grid
from core.field.grid_diffusion import FARTHEST, LEAST_LENGTH, check_held, grid_axes
from core.points import local_spacing
from tests import shapes


def torus(n):
    points = shapes.torus(n)
    ring = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    return points, (points - ring) / 0.4


def scattered(n):
    points = shapes.scattered_sphere(n)
    return points, points


def closed_form(points, normals, spacing, x, k=64):
    distance, sample = KDTree(points).query(x, k=k)
    height = np.einsum("mki,mki->mk", x[:, None] - points[sample], normals[sample])
    weight, pull = kernel_weights(distance, spacing[sample], height)
    return fused_axes(weight, pull, np.moveaxis(normals[sample], 2, 0))


def resolving(points, cells):
    """Grid with sqrt(t) of about so many cells."""
    spacing = local_spacing(points)
    side = np.ptp(points, axis=0).max() * 1.25
    return fit_grid(points, round(cells * side / (DIFFUSION_LENGTH * np.median(spacing)))), spacing


@pytest.mark.parametrize(
    ("shape", "n", "cells", "near", "everywhere"),
    [
        (torus, 1500, 1.05, 0.5, 1.0),
        (torus, 1500, LEAST_LENGTH + 0.02, 2.0, 2.0),
        (scattered, 800, LEAST_LENGTH + 0.02, 2.0, 2.0),
    ],
)
def test_where_the_grid_resolves_t_it_agrees_with_the_kernels(shape, n, cells, near, everywhere, random):
    points, normals = shape(n)
    grid, spacing = resolving(points, cells)
    axes = grid_axes(points, normals * random.choice([-1.0, 1.0], (n, 1)), spacing, grid).reshape(-1, 3)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=-1), 1)
    some = random.choice(len(axes), 10_000)
    nodes = grid.positions(some)
    distance, _ = KDTree(points).query(nodes)
    cosine = np.einsum("mi,mi->m", axes[some], closed_form(points, normals, spacing, nodes))
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.median(angle[distance < 2 * spacing.mean()]) < near
    assert np.median(angle) < everywhere
    assert (cosine > 0).mean() > 0.97


def test_a_stride_picks_nodes_of_the_same_solution():
    points, normals = torus(600)
    grid, spacing = resolving(points, 0.7)
    every, some = (grid_axes(points, normals, spacing, grid, stride) for stride in (1, 2))
    np.testing.assert_array_equal(some, every[::2, ::2, ::2])


def test_poisson_with_either_diffusion_finds_the_sphere():
    kernel, grid = (
        reconstruct(
            shapes.scattered_sphere(800),
            Settings(resolution=40, surface="none", integration="poisson", diffusion=diffusion),
        ).field
        for diffusion in ("kernel", "grid")
    )
    true = shapes.sphere_distance(shapes.node_positions(grid))
    assert np.abs(grid.values.ravel() - true).mean() < 0.08 * grid.spacing
    assert 0 < np.abs(grid.values - kernel.values).mean() < 0.08 * grid.spacing


def test_a_coarse_grid_is_refused_and_the_resolution_named_is_enough():
    points = shapes.sphere(1200)
    chosen = {"surface": "none", "integration": "poisson", "diffusion": "grid"}
    with pytest.raises(SettingsError, match=r"use resolution (\d+) or more") as refused:
        reconstruct(points, Settings(resolution=16, **chosen))
    enough = int(str(refused.value).split("use resolution ")[1].split()[0])
    assert 16 < enough < 40
    reconstruct(points, Settings(resolution=enough, **chosen))


def test_dense_points_are_refused_before_the_directions_drown():
    """Just within the limit the axes are still right."""
    points, normals = torus(3000)
    grid, spacing = resolving(points, 0.6)
    length = DIFFUSION_LENGTH * np.median(spacing)
    with pytest.raises(SettingsError, match="fewer points"):
        check_held(spacing, grid, 1.01 * FARTHEST * length)
    check_held(spacing, grid, 0.99 * FARTHEST * length)
    nodes = grid.positions(np.arange(np.prod(grid.shape)))
    distance, _ = KDTree(points).query(nodes)
    edge = (distance > 0.9 * FARTHEST * length) & (distance < FARTHEST * length)
    assert edge.sum() > 50
    axes = grid_axes(points, normals, spacing, grid).reshape(-1, 3)[edge]
    cosine = np.einsum("mi,mi->m", axes, closed_form(points, normals, spacing, nodes[edge]))
    assert np.degrees(np.arccos(np.median(cosine))) < 5
    assert cosine.min() > 0.9


def test_with_transport_it_is_refused_in_a_line():
    with pytest.raises(SettingsError, match="set integration to poisson"):
        Settings(diffusion="grid")
