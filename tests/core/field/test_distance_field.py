import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core import DistanceField, InputError
from tests import shapes

ORIGIN, SPACING, SHAPE = np.array([10.0, -2.0, 3.0]), 0.25, (9, 5, 7)
HIGH = ORIGIN + SPACING * (np.array(SHAPE) - 1)
coefficients = st.floats(-3, 3)
unit_points = arrays(np.float64, (20, 3), elements=st.floats(0, 1))


def field_of(function):
    empty = DistanceField(np.zeros(SHAPE, np.float32), ORIGIN, SPACING)
    values = function(shapes.node_positions(empty)).reshape(SHAPE)
    return dataclasses.replace(empty, values=values.astype(np.float32))


def noise():
    return field_of(lambda x: np.random.default_rng(0).uniform(0, 1, len(x)))


def test_a_fresh_field_is_dense_and_unsigned():
    field = noise()
    assert field.band == np.inf
    assert field.sdf is False


def test_holds_its_values_at_its_nodes():
    field = noise()
    x = shapes.node_positions(field)
    np.testing.assert_allclose(x.reshape(*SHAPE, 3)[3, 1, 6], ORIGIN + SPACING * np.array([3, 1, 6]))
    np.testing.assert_allclose(field.sample(x), field.values.ravel(), atol=1e-6)


@given(unit_points, coefficients, coefficients, coefficients, coefficients)
def test_a_multilinear_field_is_sampled_exactly(at, a, b, c, d):
    def function(x):
        x, y, z = (x - ORIGIN).T
        return a + b * x + c * y * z + d * x * y * z

    x = ORIGIN + at * (HIGH - ORIGIN)
    np.testing.assert_allclose(field_of(function).sample(x), function(x), atol=1e-4)


def test_outside_the_box_the_way_to_it_is_added():
    field = noise()
    x = np.array([HIGH + np.array([3, 4, 0]), ORIGIN - [0, 0, 2], (ORIGIN + HIGH) / 2 + [0, 50, 0]])
    edge = np.clip(x, ORIGIN, HIGH)
    np.testing.assert_allclose(field.sample(x), field.sample(edge) + np.linalg.norm(x - edge, axis=1))
    np.testing.assert_allclose(field.sample(x[:1]), field.values[-1, -1, -1] + 5, atol=1e-6)


def test_however_far_outside_there_is_a_distance():
    for factor in (1e30, 1e200):
        x = np.array([[3, -4, 0], [0, 0, 5]]) * factor
        np.testing.assert_allclose(noise().sample(x), 5 * factor)


def test_is_continuous_across_the_side_of_the_box():
    field = noise()
    x = ORIGIN + np.random.default_rng(1).uniform(0, 1, (50, 3)) * (HIGH - ORIGIN)
    x[:, 0] = HIGH[0]
    hair = np.array([1e-7, 0, 0])
    np.testing.assert_allclose(field.sample(x + hair), field.sample(x - hair), atol=1e-5)


def test_gradient_is_the_central_difference_of_sample(random):
    field = noise()
    x = random.uniform(ORIGIN - 0.5, HIGH + 0.5, (100, 3))
    half = SPACING / 2
    expected = [(field.sample(x + e) - field.sample(x - e)) / SPACING for e in half * np.eye(3)]
    np.testing.assert_allclose(field.gradient(x), np.stack(expected, axis=1), atol=1e-9)


@given(unit_points, coefficients, coefficients, coefficients)
def test_gradient_of_a_linear_field_is_its_slope(at, a, b, c):
    slope = np.array([a, b, c])
    inside = ORIGIN + SPACING / 2 + at * (HIGH - ORIGIN - SPACING)
    np.testing.assert_allclose(field_of(lambda x: x @ slope).gradient(inside), np.tile(slope, (20, 1)), atol=1e-3)


def test_gradient_of_a_run_points_away_from_the_surface(sphere_run, random):
    x = random.normal(size=(500, 3))
    x *= (random.choice([0.75, 1.15], (500, 1))) / np.linalg.norm(x, axis=1, keepdims=True)
    radius = np.linalg.norm(x, axis=1, keepdims=True)
    away = np.where(radius > 1, 1, -1) * x / radius
    gradient = sphere_run.field.gradient(x)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=0.1)
    assert np.einsum("mi,mi->m", gradient, away).min() > 0.95


@pytest.mark.parametrize("x", [[[10, -2, 3]], np.array([[10, -2, 3]], np.float32), ((10, -2, 3),)])
def test_takes_what_numpy_takes(x):
    field = noise()
    assert field.sample(x).dtype == np.float64
    assert field.sample(x)[0] == field.values[0, 0, 0]
    assert field.gradient(x).shape == (1, 3)


def test_no_points_give_no_values():
    assert noise().sample(np.empty((0, 3))).shape == (0,)
    assert noise().gradient(np.empty((0, 3))).shape == (0, 3)


def test_sampling_changes_nothing():
    field, x = noise(), np.array([[10.1, -1.9, 3.3]])
    kept = x.copy()
    assert field.sample(x).tobytes() == field.sample(x).tobytes()
    field.gradient(x)
    np.testing.assert_array_equal(x, kept)


@pytest.mark.parametrize(
    ("x", "message"),
    [
        ([0, 0, 0], r"shape \(3,\)"),
        ([[0, 0], [1, 1]], r"shape \(2, 2\)"),
        ([], r"shape \(0,\)"),
        ("abc", "not an array of real numbers"),
        ([[0, 0, 1j]], "complex numbers"),
        ([[0, 0, np.nan], [0, 0, 0]], "1 of 2 points are not finite"),
    ],
)
def test_what_are_no_points_is_refused(x, message):
    for asked in (noise().sample, noise().gradient):
        with pytest.raises(InputError, match=message):
            asked(x)


def test_no_points_have_no_distances():
    assert noise().sample(np.empty((0, 3))).shape == (0,)
