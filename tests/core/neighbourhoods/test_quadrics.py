import numpy as np
import pytest

from core.neighbourhoods.quadrics import fit_quadrics, nested_quadrics, nested_residuals
from tests import shapes


def paraboloid(n=600, bend=(0.4, -0.3)):
    flat = np.random.default_rng(0).uniform(-1, 1, (n, 2))
    return np.column_stack([flat, flat**2 @ bend])


def test_a_sample_lifted_off_a_quadric_falls_back_onto_it():
    points = paraboloid()
    middle = int(np.linalg.norm(points, axis=1).argmin())
    lifted = points.copy()
    lifted[middle] += [0, 0, 0.02]
    fit = fit_quadrics(lifted, np.array([middle]), 40)
    assert 0.018 < fit.left_out()[0] < 0.036
    assert fit_quadrics(points, np.arange(len(points)), 40).height.max() < 2e-3


def test_normals_are_those_of_the_quadric_even_where_neighbours_are_on_one_side():
    points = shapes.hemisphere(2000)
    rim = np.flatnonzero(points[:, 2] < 0.01)
    fit = fit_quadrics(points, rim, 40)
    np.testing.assert_allclose(np.linalg.norm(fit.normal, axis=1), 1)
    assert np.abs(np.einsum("ni,ni->n", fit.normal, points[rim])).min() > np.cos(0.02)


def test_one_stray_does_not_bend_the_others():
    points = np.vstack([shapes.square(400), [[0.01, 0.01, 0.3]]])
    near = np.flatnonzero(np.linalg.norm(points[:400], axis=1) < 0.5)
    assert fit_quadrics(points, near, 40).height.max() < 0.01


def test_turning_and_scaling_carry_over():
    points, turn = paraboloid(), shapes.random_rotation(3)
    rows = np.arange(0, len(points), 7)
    here, there = fit_quadrics(points, rows, 30), fit_quadrics(8 * points @ turn.T, rows, 30)
    np.testing.assert_allclose(there.step, 8 * here.step @ turn.T, atol=1e-4)
    np.testing.assert_allclose(there.leverage, here.leverage, rtol=1e-2)


def test_leverage_is_the_share_of_itself():
    """A sample that is moved off the quadric takes it along by this share, and so has the rest left to go."""
    rough = shapes.square(900) + np.random.default_rng(0).normal(size=(900, 3)) * [0, 0, 0.01]
    fit = fit_quadrics(rough, np.arange(900), 20)
    rows = np.flatnonzero((fit.height < 1e-3) & (np.abs(rough[:, :2]).max(axis=1) < 0.8))[:20]
    moved, far = [], 1e-4
    for row in rows:
        after = rough.copy()
        after[row, 2] += far
        moved.append(fit.step[row, 2] - fit_quadrics(after, np.array([row]), 20).step[0, 2])
    assert len(rows) == 20
    np.testing.assert_allclose(1 - np.array(moved) / far, fit.leverage[rows], rtol=0.3)  # robust weights follow it, too


def test_a_quadric_through_its_own_points_is_found_exactly():
    x, y = np.mgrid[-5:6, -5:6].reshape(2, -1) / 5
    turn = shapes.random_rotation(1)
    points = np.column_stack([x, y, 0.3 * x * x + 0.2 * x * y - 0.25 * y * y]) @ turn.T
    fit = fit_quadrics(points, np.array([60]), 121)  # the middle one, where the tangent plane is that of the axes
    assert fit.height[0] < 1e-6 < 1e-3 < np.abs(points @ turn[:, 2]).max()
    np.testing.assert_allclose(np.abs(fit.normal[0] @ turn), [0, 0, 1], atol=1e-6)
    slid = points + 0.1 * turn[:, 2] * (np.arange(121) == 60)[:, None]
    np.testing.assert_allclose(fit_quadrics(slid, np.array([60]), 121).step[0], -0.1 * turn[:, 2], atol=0.01)


def test_neighbourhoods_within_one_another_are_fitted_as_each_by_itself():
    points, rows, sizes = shapes.scattered_sphere(800), np.arange(0, 800, 3), (12, 20, 90)
    for size, fit in zip(sizes, nested_quadrics(points, rows, sizes), strict=True):
        alone = fit_quadrics(points, rows, size)
        np.testing.assert_array_equal(fit.step, alone.step)
        np.testing.assert_array_equal(fit.leverage, alone.leverage)
        farthest = np.sort(np.linalg.norm(points[rows, None] - points, axis=2), axis=1)[:, size - 1]
        np.testing.assert_allclose(fit.radius, farthest, rtol=1e-12)


def test_clusters_stand_for_the_points_of_wide_neighbourhoods():
    points = shapes.scattered_sphere(20000)
    points = points + np.random.default_rng(2).normal(size=points.shape) * 0.02
    rows = np.arange(0, len(points), 50)
    wide, (singly,) = fit_quadrics(points, rows, 800), nested_quadrics(points, rows, (800,))
    true = np.linalg.norm(points[rows], axis=1)[:, None] - 1
    off, off_singly = (np.abs(np.linalg.norm(points[rows] + fit.step, axis=1) - 1).mean() for fit in (wide, singly))
    assert off < 1.15 * off_singly < 0.2 * np.abs(true).mean()
    assert np.linalg.norm(wide.step - singly.step, axis=1).mean() < 0.1 * singly.height.mean()
    np.testing.assert_allclose(np.median(wide.leverage), np.median(singly.leverage), rtol=0.1)
    np.testing.assert_allclose(np.median(wide.radius), np.median(singly.radius), rtol=0.1)


def test_residuals_tell_two_sheets_from_noise():
    """Kurtosis is 1 on two sheets, 3 in Gaussian and 1.8 in uniform noise, and the quadric follows a little of either;
    where nothing is off there is none."""
    flat, rng = shapes.random_rotation(2) @ np.array([0, 0, 1.0]), np.random.default_rng(0)
    square = shapes.square(4000) @ shapes.random_rotation(2).T
    rows = np.flatnonzero(np.abs(square @ shapes.random_rotation(2)).max(axis=1) < 0.6)
    for off, kurtosis, rel in [
        (rng.choice([-1.0, 1.0], 4000), 1.0, 0.2),
        (rng.normal(size=4000), 3.0, 0.1),
        (np.sqrt(3) * rng.uniform(-1, 1, 4000), 1.8, 0.15),
    ]:
        (found,) = nested_residuals(square + 0.01 * off[:, None] * flat, rows, (128,))
        assert np.median(found.kurtosis) == pytest.approx(kurtosis, rel=rel)
        assert np.median(found.level) == pytest.approx(0.01, rel=0.1)
        assert np.median(np.abs(found.normal @ flat)) > 0.99
    (found,) = nested_residuals(shapes.square(400), np.arange(9), (32,))
    assert not (found.kurtosis < 1).any()
    assert found.level.max() < 1e-12
