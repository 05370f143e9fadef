import numpy as np

from core.cleaning.quadrics import fit_quadrics
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
    """On a regular neighbourhood the shares of a least-squares height sum to one, its own among them."""
    points = shapes.square(900)
    leverage = fit_quadrics(points, np.arange(len(points)), 60).leverage
    assert ((leverage > 1 / 60) & (leverage <= 0.95)).all()
