"""The method's steps in the plane, on a circle and on a straight piece, whose answers are known."""

import numpy as np
import pytest

from benchmarks import plane


@pytest.fixture(scope="module")
def circle():
    """40 points of a circle of radius .3 at uneven steps."""
    turn = 2 * np.pi * (np.arange(40) + np.random.default_rng(0).uniform(-0.2, 0.2, 40)) / 40
    return 0.3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)


@pytest.fixture(scope="module")
def axes(circle):
    return plane.normals(circle, *plane.bisectors(circle))


def test_bisectors_are_equally_far_from_both_samples_and_no_other_is_nearer(circle):
    pairs, edges = plane.bisectors(circle)
    assert len(pairs) >= len(circle)
    for ends in edges.transpose(1, 0, 2):
        far = np.linalg.norm(ends[:, None] - circle, axis=2)
        own = np.take_along_axis(far, pairs, axis=1)
        np.testing.assert_allclose(own[:, 0], own[:, 1])
        assert (own[:, 0] <= far.min(axis=1) + 1e-9).all()
        assert own.max() <= 2.5 * plane.spacing_of(circle) + 1e-9


def test_axes_of_a_circle_are_its_radii(circle, axes):
    agreement = np.abs(np.einsum("ni,ni->n", axes, circle / 0.3))
    assert agreement.min() > np.cos(np.radians(0.5))


def test_directions_lead_away_on_either_side(circle, axes):
    for radius, sign in ((0.25, -1), (0.35, 1)):
        x = circle * radius / 0.3
        directions = plane.diffused(circle, axes, x)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
        assert np.einsum("ni,ni->n", directions, sign * circle / 0.3).min() > np.cos(np.radians(5))


def test_integrated_directions_are_the_distance_near_a_circle(circle, axes):
    x, step = plane.nodes(circle, 81)
    u = plane.integrated(circle, plane.diffused(circle, axes, x), x, step)
    radius = np.linalg.norm(x, axis=-1)
    near = np.abs(radius - 0.3) < 0.1
    assert np.abs(u - np.abs(radius - 0.3))[near].mean() < 0.5 * step


def test_patches_end_where_a_straight_piece_does():
    points = np.stack([np.linspace(-0.3, 0.3, 25), np.zeros(25)], axis=1)
    x = np.array([[0.1, 0.05], [0.2, -0.1], [0.5, 0.0], [-0.5, 0.1]])
    beyond = 0.2 - 0.35 * plane.spacing_of(points)
    expected = [0.05, 0.1, beyond, np.hypot(beyond, 0.1)]
    np.testing.assert_allclose(plane.to_patches(points, np.tile([0.0, 1.0], (25, 1)), x), expected, atol=1e-9)
