import numpy as np
import pytest
from scipy.spatial import KDTree

from core.cleaning.meeting_sheets import onto_one_sheet
from core.cleaning.positions import denoise
from core.neighbourhoods.quadrics import fit_quadrics
from core.points import local_spacing
from tests import shapes


def wedge(degrees, n=6000, noise=0.0, seed=0):
    """Two rectangles of width 0.5 and length 1 that share one long edge, along Z at the origin, and the edge's angle
    between them; with noise, in median local spacings."""
    rng = np.random.default_rng(seed)
    across, half = rng.uniform(0, 0.5, n), np.radians(degrees) / 2
    points = np.column_stack([across * np.cos(half), across * np.sin(half) * rng.choice([-1, 1], n), rng.random(n)])
    return points + noise * np.median(local_spacing(points)) * rng.normal(size=points.shape)


def off_wedge(points, degrees):
    half = np.radians(degrees) / 2
    x, y = points[:, 0], np.abs(points[:, 1])
    along = np.maximum(x * np.cos(half) + y * np.sin(half), 0)
    return np.hypot(x - along * np.cos(half), y - along * np.sin(half))


def fitted(points, rows, k):
    fit = fit_quadrics(points, rows, k)
    found = np.zeros_like(points), np.zeros_like(points), np.zeros(len(points))
    for whole, part in zip(found, (fit.step, fit.normal, fit.spread), strict=True):
        whole[rows] = part
    return found


@pytest.mark.parametrize(("degrees", "share"), [(35, 0.7), (60, 0.82), (90, 0.99)])
def test_samples_beside_an_edge_come_closer_to_its_faces(degrees, share):
    points = wedge(degrees, noise=0.2)
    h = np.median(local_spacing(points))
    beside = (np.hypot(points[:, 0], points[:, 1]) < 4 * h) & (np.abs(points[:, 2] - 0.5) < 0.4)
    every, level = np.arange(len(points)), np.full(len(points), 0.2 * h)
    fit = fitted(points, every, 48)
    moved = points + onto_one_sheet(KDTree(points), every, 48, fit, level)
    error, before = (np.sqrt(np.mean(off_wedge(x[beside], degrees) ** 2)) for x in (moved, points + fit[0]))
    assert error < share * before


def test_denoised_wedges_keep_their_faces_apart():
    points = wedge(40, noise=0.2)
    h = np.median(local_spacing(points))
    moved, _ = denoise(points, local_spacing(points))
    beside = (np.hypot(moved[:, 0], moved[:, 1]) < 4 * h) & (np.abs(moved[:, 2] - 0.5) < 0.4)
    assert off_wedge(moved[beside], 40).mean() < 0.125 * h


def test_smooth_surfaces_keep_their_quadrics():
    points = shapes.scattered_sphere(4000)
    points += 0.3 * np.median(local_spacing(points)) * np.random.default_rng(0).normal(size=points.shape)
    every, level = np.arange(4000), np.full(4000, 0.3 * np.median(local_spacing(points)))
    fit = fitted(points, every, 64)
    step = onto_one_sheet(KDTree(points), every, 64, fit, level)
    assert (step != fit[0]).any(axis=1).mean() < 0.02


def test_samples_without_a_quadric_are_no_sheet():
    """Planes are asked of samples that have one: others have no normal."""
    points = wedge(60, n=3000, noise=0.2)
    rows = np.flatnonzero(points[:, 2] < 0.5)
    level = np.full(3000, 0.2 * np.median(local_spacing(points)))
    step = onto_one_sheet(KDTree(points), rows, 32, fitted(points, rows, 32), level)
    assert step.shape == (len(rows), 3)
    assert np.linalg.norm(step, axis=1).max() < 10 * level[0]


def test_turning_and_scaling_carry_over():
    points, turn = wedge(60, n=2000, noise=0.2), shapes.random_rotation(3)
    every, level = np.arange(2000), np.full(2000, 0.2 * np.median(local_spacing(points)))
    here = onto_one_sheet(KDTree(points), every, 32, fitted(points, every, 32), level)
    turned = 8 * points @ turn.T
    there = onto_one_sheet(KDTree(turned), every, 32, fitted(turned, every, 32), 8 * level)
    alike = np.linalg.norm(there - 8 * here @ turn.T, axis=1) < 0.1 * level[0]
    assert alike.mean() > 0.99  # rounding decides for few
