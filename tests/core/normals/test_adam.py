import numpy as np
import pytest

from core import Cancelled
from core.normals.adam import MAX_STEPS, minimise
from tests import shapes
from tests.shapes import scattered_sphere as random_axes

TARGETS = random_axes(50, 9)


def away_from_targets(axes, targets=TARGETS):
    """Sum of squared sines, which has two minima of each axis, and its gradient."""
    cosine = np.einsum("ni,ni->n", axes, targets)
    return float((1 - cosine**2).sum()), -2 * cosine[:, None] * targets


def test_finds_the_axes_stops_by_itself_and_keeps_them_unit():
    axes, history = minimise(away_from_targets, random_axes(50, 1))
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", axes, TARGETS)), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, rtol=1e-12)
    assert len(history) < MAX_STEPS
    assert history[0] == away_from_targets(random_axes(50, 1))[0]


def test_returns_the_lowest_value_met():
    axes, history = minimise(away_from_targets, random_axes(50, 1), max_steps=40)
    assert len(history) == 40
    assert away_from_targets(axes)[0] == min(history)


def test_a_start_of_no_energy_is_kept():
    axes, history = minimise(lambda axes: (0.0, np.zeros_like(axes)), TARGETS)
    np.testing.assert_array_equal(axes, TARGETS)
    assert history == [0.0]


def test_constraints_stay_bit_identical_and_the_start_is_not_written_to():
    start = random_axes(50, 2)
    before, held, given = start.copy(), np.array([4, 11]), random_axes(2, 3)
    axes, _ = minimise(away_from_targets, start, (held, given))
    assert axes[held].tobytes() == given.tobytes()
    np.testing.assert_array_equal(start, before)
    free = np.setdiff1d(np.arange(50), held)
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", axes, TARGETS))[free], 1.0, atol=1e-6)


def test_steps_turn_with_the_axes():
    turn, start = shapes.random_rotation(5), random_axes(50, 4)
    axes, _ = minimise(away_from_targets, start, max_steps=20)
    turned, _ = minimise(lambda x: away_from_targets(x, TARGETS @ turn.T), start @ turn.T, max_steps=20)
    np.testing.assert_allclose(turned, axes @ turn.T, atol=1e-9)


def test_what_a_gradient_says_along_an_axis_does_not_matter():
    def stretched(axes):
        value, gradient = away_from_targets(axes)
        return value, gradient + 5 * axes

    start = random_axes(50, 6)
    for steps, error in ((5, 1e-9), (20, 1e-9), (MAX_STEPS, 1e-6)):  # on the way as well
        one, other = (minimise(energy, start, max_steps=steps)[0] for energy in (stretched, away_from_targets))
        np.testing.assert_allclose(one, other, atol=error)


def test_cancels():
    with pytest.raises(Cancelled):
        minimise(away_from_targets, random_axes(50, 1), progress=lambda fraction, _: fraction < 0.01)
