"""A run that takes up the normals of an earlier one."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import InputError, Settings, reconstruct
from core.normals.known import known_normals

SPHERE = np.random.default_rng(0).normal(size=(400, 3))
SPHERE /= np.linalg.norm(SPHERE, axis=1, keepdims=True)


def test_it_finds_what_the_whole_run_finds():
    whole = reconstruct(SPHERE, Settings(resolution=24))
    again = reconstruct(whole.points, Settings(resolution=24), normals=(-3 * whole.normals, whole.confidence))
    assert_allclose(again.normals, -whole.normals, atol=1e-12)
    assert_array_equal(again.confidence, whole.confidence)
    assert_allclose(again.field.values, whole.field.values, atol=1e-6)


def test_dropped_points_take_their_normals_along():
    points = np.concatenate([SPHERE[:1], SPHERE, [[np.nan, 0, 0]]])
    axes, confidence = np.concatenate([SPHERE[:1], SPHERE, [[0, 0, 0]]]), np.linspace(0, 1, 402)
    found = reconstruct(points, Settings(resolution=16, surface="none"), normals=(axes, confidence))
    assert_allclose(found.normals, SPHERE, atol=1e-12)
    assert_array_equal(found.confidence, confidence[[0, *range(2, 401)]])


@pytest.mark.parametrize(
    ("axes", "confidence", "message"),
    [
        (SPHERE[:3], np.ones(400), r"shapes \(3, 3\) and \(400,\) for 400 points"),
        (SPHERE, np.ones(3), r"shapes \(400, 3\) and \(3,\) for 400 points"),
        (np.where(np.arange(400)[:, None] < 2, 0.0, SPHERE), np.ones(400), "2 known normals have no direction"),
        (np.where(np.arange(400)[:, None] < 2, np.inf, SPHERE), np.ones(400), "2 known normals have no direction"),
        (SPHERE, np.full(400, np.nan), "400 confidences are not finite"),
        ("north", np.ones(400), "known normals are not an array of real numbers"),
        (SPHERE, "sure", "confidences are not an array of real numbers"),
        (SPHERE + 1j, np.ones(400), "complex numbers"),
    ],
)
def test_what_cannot_be_used_is_refused(axes, confidence, message):
    with pytest.raises(InputError, match=message):
        known_normals((axes, confidence), 400, np.arange(400))


@pytest.mark.parametrize("known", [5, SPHERE, (SPHERE,)])
def test_what_is_no_pair_is_refused(known):
    with pytest.raises(InputError, match="no pair of arrays"):
        known_normals(known, 400, np.arange(400))


def test_confidence_is_taken_to_its_limits():
    assert_array_equal(known_normals((np.eye(3), [-0.5, 0.5, 2]), 3, np.arange(3))[1], [0, 0.5, 1])
