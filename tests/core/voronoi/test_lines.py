"""How far samples on lines look for others: as far as the next line, and no sample elsewhere farther than before."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.normals.estimate import estimate_normals
from core.points import local_spacing
from core.voronoi.facets import REACH
from core.voronoi.lines import across_lines
from tests import shapes

STEP = 0.01


def wavy(x, y):
    return 0.15 * np.sin(3 * x) * np.cos(2 * y)


def lines(gap, seed=0):
    """Samples (n,3) on a wavy sheet, on lines `gap` steps apart, and its normals there."""
    rng = np.random.default_rng(seed)
    y, along = (a.reshape(-1) for a in np.meshgrid(np.arange(-0.5, 0.5, gap * STEP), np.arange(-0.5, 0.5, STEP)))
    x = along + 0.2 * STEP * rng.uniform(-1, 1, len(y))
    slope = 0.45 * np.cos(3 * x) * np.cos(2 * y), -0.3 * np.sin(3 * x) * np.sin(2 * y)
    normals = np.stack([-slope[0], -slope[1], np.ones(len(x))], axis=1)
    return np.stack([x, y, wavy(x, y)], axis=1), normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("gap", [3, 10, 25])
def test_normals_of_lines_are_those_of_the_sheet(gap):
    points, normals = lines(gap)
    turn = shapes.random_rotation(gap)
    found = estimate_normals(points @ turn.T, local_spacing(points))[0] @ turn
    assert np.abs(np.einsum("ni,ni->n", found, normals)).min() > 0.98


def test_the_energy_finds_them_too():
    points, normals = lines(12)
    found = estimate_normals(points, local_spacing(points), Settings(solver="energy", backend="numpy"))[0]
    assert np.abs(np.einsum("ni,ni->n", found, normals)).mean() > 0.99


def test_facets_reach_the_next_line_and_not_much_farther():
    points, _ = lines(12)
    spacing = local_spacing(points)
    found = across_lines(points, spacing)[0]
    assert (REACH * found > 12 * STEP).mean() > 0.95
    assert (REACH * found).max() < 2 * 12 * STEP
    np.testing.assert_allclose(across_lines(7 * points, 7 * spacing)[0], 7 * found, rtol=1e-12)
    order = np.random.default_rng(0).permutation(len(points))
    np.testing.assert_allclose(across_lines(points[order], spacing[order])[0], found[order], rtol=1e-12)


def test_a_ring_looks_past_itself():
    """Its own samples to the side are nearer than those of the next ring."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = 0.1 * np.stack([np.cos(turn), np.sin(turn), np.zeros(60)], axis=1)
    points = np.concatenate([ring + np.array([0, 0, z]) for z in (0, 0.15, 0.3)])
    assert (REACH * across_lines(points, local_spacing(points))[0] > 0.15).all()


@pytest.mark.parametrize(
    "points",
    [
        shapes.scattered_sphere(3000),
        shapes.torus(2000),
        shapes.square(900),
        np.random.default_rng(0).random((3000, 3)),
        shapes.moebius(1500),
        lines(12)[0][:60],
        np.concatenate([shapes.sphere(500), np.linspace([3.0, 0, 0], [30.0, 0, 0], 300)]),
    ],
    ids=["random sphere", "torus", "square", "volume", "band", "few", "one line alone"],
)
def test_elsewhere_nothing_changes(points):
    spacing = local_spacing(points)
    assert across_lines(points, spacing)[0].tobytes() == spacing.tobytes()


@pytest.mark.parametrize("gap", [5, 6, 8])
@pytest.mark.parametrize("turn", [0.0, 0.37])
def test_a_pipe_of_rings_is_one_tube(gap, turn):
    """Flat rings were taken for sheets from 8 on, and slits were left between them from 5 on."""
    n, rings = 64, 7
    angle = 2 * np.pi * np.arange(n) / n + turn * np.arange(rings)[:, None]
    height = np.repeat(2 * np.pi / n * gap * np.arange(rings), n)
    points = np.stack([np.cos(angle).reshape(-1), np.sin(angle).reshape(-1), height], axis=1)
    run = reconstruct(points, Settings(resolution=64, surface="both"))
    assert len(shapes.components(run.surface)) == len(shapes.components(run.sheet)) == 1
    assert (run.sheet.border_loops(), shapes.euler(run.sheet)) == (2, 0)
    np.testing.assert_allclose(np.hypot(*run.sheet.vertices[:, :2].T), 1, atol=0.01)


def test_a_sheet_of_lines_far_apart_is_one_piece():
    points, _ = lines(12)
    run = reconstruct(points, Settings(resolution=64, surface="both"))
    assert len(shapes.components(run.surface)) == len(shapes.components(run.sheet)) == 1
    assert run.sheet.border_loops() == 1
    inner = run.sheet.vertices[np.abs(run.sheet.vertices[:, :2]).max(axis=1) < 0.35]
    assert np.abs(inner[:, 2] - wavy(*inner[:, :2].T)).mean() < 0.01
