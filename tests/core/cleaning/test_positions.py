import numpy as np
import pytest

from core import Cancelled
from core.cleaning.noise_level import estimate_noise
from core.cleaning.positions import LONGEST_MOVE, denoise
from core.neighbourhoods.quadrics import fit_quadrics
from core.points import local_spacing
from tests import shapes


def noisy_sphere(deviation, n=5000):
    points = shapes.scattered_sphere(n)
    return points + np.random.default_rng(7).normal(size=points.shape) * deviation


@pytest.mark.parametrize(("deviation", "factor"), [(0.0015, 2.5), (0.005, 2.5), (0.02, 4.0), (0.04, 4.0)])
def test_noisy_samples_come_closer_to_the_surface(deviation, factor):
    points = noisy_sphere(deviation)
    moved, done = denoise(points, local_spacing(points))
    before, after = (np.abs(shapes.sphere_distance(x)).mean() for x in (points, moved))
    assert before > factor * after
    assert done["noise"] == pytest.approx(deviation, rel=0.25)


@pytest.mark.parametrize("points", [shapes.scattered_sphere(2000), shapes.junction(1500), shapes.sphere(50)])
def test_clean_samples_stay_to_the_bit(points):
    moved, done = denoise(points, local_spacing(points))
    assert moved is points
    assert done == {}


def test_only_the_noisy_part_moves():
    points = shapes.scattered_sphere(2000)
    half = points[:, 0] > 0
    points[half] += np.random.default_rng(7).normal(size=(half.sum(), 3)) * 0.02
    moved, done = denoise(points, local_spacing(points))
    stirred = (moved != points).any(axis=1)
    assert done["noisy"] == stirred.sum()
    assert not stirred[points[:, 0] < -0.6].any()
    before, after = (np.abs(shapes.sphere_distance(x[half])).mean() for x in (points, moved))
    assert before > 2.5 * after


def test_zero_is_off_and_half_goes_half_the_way():
    points = noisy_sphere(0.02, 1500)
    spacing = local_spacing(points)
    assert denoise(points, spacing, 0.0)[0] is points
    whole, half = (denoise(points, spacing, strength)[0] - points for strength in (1.0, 0.5))
    bound = LONGEST_MOVE * estimate_noise(points).level
    free = np.linalg.norm(whole, axis=1) < 0.99 * bound
    assert free.mean() > 0.9
    np.testing.assert_allclose(half[free], 0.5 * whole[free], atol=1e-12)


def test_nothing_moves_further_than_the_bound():
    points = noisy_sphere(0.02, 2000)
    points[::50] *= 1.15
    moved, _ = denoise(points, local_spacing(points))
    bound = LONGEST_MOVE * estimate_noise(points).level
    length = np.linalg.norm(moved - points, axis=1)
    assert (length <= bound * (1 + 1e-9)).all()
    assert (length > 0.99 * bound).any()


def test_a_plane_with_noise_becomes_flat_and_keeps_its_rim():
    points = shapes.square(3000)
    moved, _ = denoise(points + np.random.default_rng(7).normal(size=points.shape) * 0.02, local_spacing(points))
    assert np.abs(moved[:, 2]).mean() < 0.005
    assert np.abs(moved[:, :2]).max() > 0.97


@pytest.mark.parametrize(("deviation", "rough"), [(0.1, 0.01), (0.15, 0.03)])
def test_samples_side_by_side_agree_after_heavy_noise(deviation, rough):
    points = noisy_sphere(deviation, 3000)
    moved, _ = denoise(points, local_spacing(points))
    height = fit_quadrics(moved, np.arange(len(moved)), 20).height
    assert np.percentile(height / local_spacing(moved), 95) < rough


def test_too_few_samples_for_a_quadric_stay():
    points = shapes.sphere(10)
    assert denoise(points, local_spacing(points), 1.0)[0] is points


def test_can_be_cancelled():
    points = noisy_sphere(0.02, 1000)
    with pytest.raises(Cancelled):
        denoise(points, local_spacing(points), progress=lambda fraction, text: fraction < 0.5)
