import numpy as np
import pytest

from core import Settings, reconstruct
from core.cleaning.clean import clean
from core.points import prepare_samples
from tests import shapes

CLEAN = shapes.scattered_sphere(2000)
STRAYS = np.array([[9.0, 0, 0], [0, 8.0, 1], [-7.0, 7, 7]])


def test_clean_samples_are_the_very_same():
    samples = prepare_samples(CLEAN)
    cleaned, done = clean(samples)
    assert cleaned is samples
    assert done == {"outliers": 0, "thinned": 0}


def test_without_strays_everything_is_as_if_they_had_never_been():
    with_strays = np.vstack([STRAYS[:2], CLEAN, STRAYS[2:]])
    cleaned, done = clean(prepare_samples(with_strays))
    alone = prepare_samples(CLEAN)
    assert done["outliers"] == 3
    np.testing.assert_array_equal(cleaned.points, alone.points)
    np.testing.assert_array_equal(cleaned.source_index, alone.source_index + 2)
    assert any("3 of 2003 points dropped as outliers" in warning for warning in cleaned.warnings)


def test_it_is_said_by_how_much_far_strays_enlarge_the_cells():
    [far] = clean(prepare_samples(np.vstack([CLEAN, STRAYS])))[0].warnings
    [near] = clean(prepare_samples(np.vstack([CLEAN, STRAYS / 6])))[0].warnings
    assert "cells would be 8 times as large" in far
    assert near == "3 of 2003 points dropped as outliers"


def test_switched_off_they_stay():
    points = np.vstack([CLEAN, STRAYS])
    cleaned, done = clean(prepare_samples(points), Settings(outliers=False, denoise=0))
    assert len(cleaned.points) == len(points)
    assert done == {"outliers": 0, "thinned": 0}


def test_noise_is_reported_in_input_units():
    noisy = 1000 * (CLEAN + np.random.default_rng(7).normal(size=CLEAN.shape) * 0.03)
    cleaned, done = clean(prepare_samples(noisy))
    assert 20 < done["noise"] < 40
    assert 10 < done["mean_move"] < 120
    assert np.abs(shapes.sphere_distance(cleaned.given, 1000.0)).mean() < 12


def test_a_run_returns_the_moved_samples_and_traces_them():
    noisy = CLEAN + np.random.default_rng(7).normal(size=CLEAN.shape) * 0.03
    result = reconstruct(np.vstack([STRAYS, noisy]), Settings(resolution=24, surface="none"))
    assert (result.source_index >= 3).all()
    moved = np.linalg.norm(result.points - noisy[result.source_index - 3], axis=1)
    assert moved.mean() > 0.01
    assert np.abs(shapes.sphere_distance(result.points)).mean() < 0.3 * np.abs(shapes.sphere_distance(noisy)).mean()
    assert result.report["cleaning"]["outliers"] == len(STRAYS) + len(noisy) - len(result.points)


@pytest.mark.parametrize(("denoise", "told"), [("auto", 1), (0.5, 0)])
def test_moves_that_were_asked_for_are_not_warned_of(denoise, told):
    points = shapes.sphere(1500) + np.random.default_rng(0).normal(scale=0.01, size=(1500, 3))
    cleaned, done = clean(prepare_samples(points), Settings(denoise=denoise))
    assert done["mean_move"] > 0
    assert len(cleaned.warnings) == told
