import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.cleaning.flat_patches import shows_flat_patches
from core.cleaning.noise import looks_noisy, noisy_samples
from core.cleaning.noise_level import LADDER, estimate_noise, in_full
from core.neighbourhoods.quadrics import fit_quadrics
from core.points import local_spacing
from tests import shapes

CLEAN = {
    "sphere": shapes.scattered_sphere(3000),
    "moebius": shapes.moebius(2000),
    "junction": shapes.junction(2000),
    "cylinder": shapes.cylinder(1500),
    "few": shapes.scattered_sphere(120),
    "close sheets": shapes.sheets(2000, gap=0.1),
}


def noisy(points, deviation, seed=7):
    return points + np.random.default_rng(seed).normal(size=points.shape) * deviation


@pytest.mark.parametrize("name", CLEAN)
def test_clean_clouds_are_not_noisy(name):
    assert not noisy_samples(CLEAN[name], local_spacing(CLEAN[name])).any()


@pytest.mark.parametrize("share", [0.15, 0.5, 1.0])
def test_noise_is_noticed_and_measured(share):
    points = shapes.scattered_sphere(5000)
    deviation = share * np.median(local_spacing(points))
    points = noisy(points, deviation)
    assert noisy_samples(points, local_spacing(points)).all()
    assert np.median(estimate_noise(points).level) == pytest.approx(deviation, rel=0.2)


@pytest.mark.parametrize("name", ["sphere", "moebius", "cylinder"])
@pytest.mark.parametrize("share", [0.01, 0.02, 0.05, 0.08])
def test_slight_noise_is_noticed(name, share):
    points = noisy(CLEAN[name], share * np.median(local_spacing(CLEAN[name])))
    assert looks_noisy(points, local_spacing(points))
    assert noisy_samples(points, local_spacing(points)).all()


def test_rounded_coordinates_are_slight_noise():
    points = shapes.torus(5000)
    unit = 0.1 * np.median(local_spacing(points))
    points = unit * np.rint(points / unit)
    assert noisy_samples(points, local_spacing(points)).all()


def waved(n, length, height, deviation):
    """A square with waves and noise, both in spacings."""
    points, spacing = shapes.square(n), 2 / np.sqrt(n)
    x, y = 2 * np.pi * points[:, :2].T / (length * spacing)
    points[:, 2] = height * np.sin(x) * np.sin(y) + deviation * np.random.default_rng(0).normal(size=n)
    points[:, 2] *= spacing
    return points


def test_slight_noise_among_detail_that_averaging_would_blunt_stays():
    flat, waves = waved(3000, 10, 0.0, 0.02), waved(3000, 10, 0.4, 0.02)
    assert noisy_samples(flat, local_spacing(flat)).all()
    assert not noisy_samples(waves, local_spacing(waves)).any()


def test_waves_as_short_as_samples_can_show_are_detail():
    waves = waved(2000, 4, 0.4, 0.0)
    assert not noisy_samples(waves, local_spacing(waves)).any()


@pytest.mark.parametrize(
    ("shape", "share"),
    [
        (shapes.scattered_sphere(2000), 0.3),
        (shapes.torus(2000), 0.8),
        (shapes.moebius(1500), 0.3),
        (shapes.moebius(3000), 0.45),  # beside the noise its other half looks flat
    ],
)
def test_noise_of_one_half_is_found_there(shape, share):
    points, half = shape.copy(), shape[:, 0] > 0
    deviation = share * np.median(local_spacing(points))
    points[half] = noisy(points[half], deviation)
    found = noisy_samples(points, local_spacing(points))
    assert found[half].mean() > 0.97
    assert not found[shape[:, 0] < -0.6].any()
    level = estimate_noise(points, noisy=found).level
    assert np.median(level[found]) == pytest.approx(deviation, rel=0.25)


@pytest.mark.parametrize("gap", [0.036, 0.04])  # at the first both rules take them for noise, but for the normals
def test_noise_of_a_large_cloud_is_told_from_close_sheets_in_a_few_places(gap):
    sheets = shapes.sheets(8000, gap)
    assert looks_noisy(sheets, local_spacing(sheets))
    assert not noisy_samples(sheets, local_spacing(sheets)).any()
    points = shapes.torus(8000)
    points = noisy(points, 0.15 * np.median(local_spacing(points)))
    assert noisy_samples(points, local_spacing(points)).all()


@pytest.mark.parametrize("deviation", [0.003, 0.02])
def test_what_is_rough_in_a_small_place_may_be_detail(deviation):
    points = shapes.scattered_sphere(4000)
    rough = points[:, 2] > 0.93
    points[rough] = noisy(points[rough], deviation)
    assert not noisy_samples(points, local_spacing(points)).any()


@pytest.mark.parametrize("share", [0.045, 0.15])
@pytest.mark.parametrize("shape", [shapes.torus(3000), shapes.scattered_sphere(5000)], ids=["torus", "sphere"])
def test_faint_noise_of_one_half_is_found_there(shape, share):
    points, half = shape.copy(), shape[:, 0] > 0
    points[half] = noisy(points[half], share * np.median(local_spacing(points)))
    found = noisy_samples(points, local_spacing(points))
    assert found[half].mean() > 0.9
    assert not found[shape[:, 0] < -0.4].any()


def test_noise_of_one_half_is_not_averaged_as_the_slight_noise_of_the_other_is():
    points = shapes.scattered_sphere(5000)
    spacing, half = np.median(local_spacing(points)), points[:, 0] > 0
    points = noisy(points, np.where(half, 0.2, 0.01)[:, None] * spacing)
    found = noisy_samples(points, local_spacing(points))
    assert found[half].mean() > 0.95
    assert not found[points[:, 0] < -0.5].any()


def test_waves_of_one_half_are_detail():
    waves = waved(3000, 4, 0.2, 0.0)
    waves[waves[:, 0] < 0, 2] = 0
    assert not noisy_samples(waves, local_spacing(waves)).any()


def bumpy(n, height):
    x, y, z = 5 * shapes.scattered_sphere(n).T
    return np.column_stack([x, y, z]) / 5 * (1 + height * np.sin(x) * np.sin(y) * np.sin(z + 1))[:, None]


def two_scans(points, share):
    """Points at random of one of two scans, `share` local spacings apart in one direction."""
    second = np.random.default_rng(1).random(len(points)) < 0.5
    return points + np.outer(second, share * np.median(local_spacing(points)) * np.array([0.3, 0.4, 0.866]))


@pytest.mark.parametrize(("height", "share"), [(0.0, 0.1), (0.0, 0.3), (0.2, 0.2), (0.2, 0.3)])
def test_shifted_scans_are_noisy_as_a_whole(height, share):
    """Though they agree where the shift runs along the surface, and what shows there is detail."""
    points = bumpy(5000, height)
    assert not noisy_samples(points, local_spacing(points)).any()
    points = two_scans(points, share)
    assert noisy_samples(points, local_spacing(points)).all()


def shifted_scans(points, count, share):
    """Points at random of one of several scans, each shifted its own way by `share` local spacings."""
    random = np.random.default_rng(4)
    shifts = random.normal(size=(count, 3))
    shifts *= share * np.median(local_spacing(points)) / np.linalg.norm(shifts, axis=1)[:, None]
    return points + shifts[random.integers(count, size=len(points))]


@pytest.mark.parametrize(("count", "share"), [(3, 0.2), (3, 0.4), (4, 0.4), (5, 0.4)])
def test_more_than_two_shifted_scans_are_noisy_as_a_whole(count, share):
    """Though they show two sheets where two groups of them lie apart along the normal."""
    points = bumpy(5000, 0.2) * [1.0, 0.7, 0.5]
    assert not noisy_samples(points, local_spacing(points)).any()
    points = shifted_scans(points, count, share)
    assert noisy_samples(points, local_spacing(points)).all()


def test_shifted_scans_with_some_noise_are_noisy():
    """Few of their samples lie sharply on one of two sheets."""
    points = bumpy(6000, 0.2)
    points = noisy(two_scans(points, 0.4), 0.05 * np.median(local_spacing(points)))
    assert noisy_samples(points, local_spacing(points)).all()


def test_shifted_scans_of_flat_faces_are_noisy():
    """Though every point lies on a face of one of them."""
    golden = (1 + np.sqrt(5)) / 2
    axes = [np.roll([0.0, 1.0, sign * golden], turn) for turn in range(3) for sign in (-1, 1)]
    ball = shapes.scattered_sphere(5000)
    points = ball / np.abs(ball @ np.transpose(axes)).max(axis=1)[:, None]
    assert not noisy_samples(points, local_spacing(points)).any()
    points = two_scans(points, 0.4)
    assert shows_flat_patches(points, local_spacing(points), np.arange(0, 5000, 2), 0.1)
    assert noisy_samples(points, local_spacing(points)).all()


def walled(points, normals, share):
    """Points at random on two sheets that are `share` local spacings apart all over."""
    side = np.random.default_rng(1).choice([-0.5, 0.5], len(points)) * share * np.median(local_spacing(points))
    return points + side[:, None] * normals


@pytest.mark.parametrize("share", [0.2, 0.3, 0.5])
def test_thin_walls_are_no_noise(share):
    """They look like it, and like scans shifted against each other but for their distance, the same all over."""
    ball = shapes.scattered_sphere(5000)
    points = walled(ball, ball, share)
    assert looks_noisy(points, local_spacing(points))
    assert not noisy_samples(points, local_spacing(points)).any()


@pytest.mark.parametrize("axes", [(1.0, 0.7, 0.5), (1.0, 1.0, 0.4), (1.0, 0.4, 0.4)])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_walls_between_a_shape_and_its_copy_in_another_size_are_no_noise(axes, share):
    """The squares of their thickness are a quadratic form of the normal, as if of many shifted scans."""
    points = shapes.scattered_sphere(6000) * axes
    sign = np.random.default_rng(1).choice([-0.5, 0.5], len(points))
    points *= (1 + sign * share * np.median(local_spacing(points)))[:, None]
    assert looks_noisy(points, local_spacing(points))
    assert not noisy_samples(points, local_spacing(points)).any()


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_walls_of_a_bumpy_shape_are_no_noise(share):
    """Few anchors there see two sheets, since the walls bend, but thickness has nothing to do with the normal."""
    ball, points = shapes.scattered_sphere(6000), bumpy(6000, 0.2)
    sines, cosines = (wave(5 * ball + [0, 0, 1]) for wave in (np.sin, np.cos))
    slope = cosines * np.roll(sines, 1, axis=1) * np.roll(sines, 2, axis=1)
    normals = ((points + slope) * ball).sum(axis=1, keepdims=True) * ball - slope
    points = walled(points, normals / np.linalg.norm(normals, axis=1)[:, None], share)
    assert looks_noisy(points, local_spacing(points))
    assert not noisy_samples(points, local_spacing(points)).any()


def test_walls_of_two_thicknesses_are_no_noise():
    """A shift would fit a base and a lid of any thickness."""
    floor = shapes.square(4000) + np.array([1.0, 0, 0])
    base, lid = (walled(floor, np.array([0, 0, 1.0]), share) for share in (0.3, 0.5))
    points = np.concatenate([base, Rotation.from_euler("y", -120, degrees=True).apply(lid)])
    assert looks_noisy(points, local_spacing(points))
    assert not noisy_samples(points, local_spacing(points)).any()


def shelf(thickness, n):
    """About n random points, even over five boards between two sides, and a back half as thick as these."""
    boards = [((1.0, 0.4, thickness), (0.0, 0.0, z)) for z in np.linspace(0, 1.2, 5)]
    sides = [((thickness, 0.4, 1.2), (x, 0.0, 0.0)) for x in (0.0, 1.0)]
    parts = [*boards, *sides, ((1.0, 0.5 * thickness, 1.2), (0.0, 0.4, 0.0))]
    areas = np.array([x * y + y * z + z * x for (x, y, z), _ in parts])
    counts = np.rint(n * areas / areas.sum()).astype(int)
    boxes = [shapes.scattered_box(m, size) + place for m, (size, place) in zip(counts, parts, strict=True)]
    return np.concatenate(boxes) @ shapes.random_rotation(1).T


def test_walls_of_furniture_are_no_noise():
    """Few anchors see two sheets, and thickness goes with the normal, of which there are three kinds."""
    points = shelf(0.018, 9000)
    assert not noisy_samples(points, local_spacing(points)).any()


def stacked(sheets, gap, n=6000):
    """Points at random on flat sheets `gap` local spacings apart, askew in the box."""
    points = shapes.square(n)
    points[:, 2] += gap * np.median(local_spacing(points)) * np.random.default_rng(1).integers(sheets, size=n)
    return Rotation.from_euler("xyz", [20, 30, 40], degrees=True).apply(points)


@pytest.mark.parametrize(("sheets", "gap"), [(5, 0.4), (6, 0.3), (8, 0.2)])
def test_stacks_of_flat_sheets_are_no_noise(sheets, gap):
    points = stacked(sheets, gap)
    spacing = local_spacing(points)
    assert looks_noisy(points, spacing)
    assert not noisy_samples(points, spacing).any()
    assert noisy_samples(noisy(points, 0.1 * np.median(spacing)), spacing).all()


@pytest.mark.parametrize("steps", [0.25, 0.5, 1.0, 2.0])
def test_noise_that_rounding_lays_on_planes_is_noise(steps):
    """By steps in standard deviations of it."""
    points = shapes.square(6000)
    deviation = 0.3 * np.median(local_spacing(points))
    points = noisy(points, deviation)
    points = np.unique(steps * deviation * np.rint(points / (steps * deviation)), axis=0)
    assert noisy_samples(points, local_spacing(points)).all()


def test_noise_beside_thin_walls_is_found():
    """The cloud looks noisy as a whole; as it has walls, its parts are looked at."""
    ball = shapes.scattered_sphere(8000)
    half, spacing = ball[:, 0] > 0, np.median(local_spacing(ball))
    points = np.where(half[:, None], noisy(ball, 0.1 * spacing), walled(ball, ball, 1.0))
    heard = []
    found = noisy_samples(points, local_spacing(points), progress=lambda share, _: heard.append(share))
    assert found[half].mean() > 0.9
    assert not found[ball[:, 0] < -0.5].any()
    assert heard == sorted(heard)


def test_more_noise_takes_more_neighbours_and_more_curvature_fewer():
    ring = shapes.torus(6000, major=1.0, minor=0.15)
    few, many = (np.median(estimate_noise(noisy(ring, deviation)).neighbours) for deviation in (0.002, 0.02))
    assert LADDER[0] <= few < many <= LADDER[-1] * 1.001
    flat = np.median(estimate_noise(noisy(shapes.square(6000), 0.002)).neighbours)
    assert few < flat


@pytest.mark.parametrize("deviation", [0.02, 0.06])
def test_noise_of_many_spacings_is_measured_in_neighbourhoods_wide_enough(deviation):
    points = noisy(shapes.scattered_sphere(40000), deviation)
    found = estimate_noise(points)
    assert np.median(found.level) == pytest.approx(deviation, rel=0.15)
    assert np.median(found.neighbours) > 2 * LADDER[-1]


def test_a_thin_ring_is_not_taken_for_noise():
    """It is two and a half times as thick as the noise; neighbourhoods that reach round it see all of that."""
    found = estimate_noise(noisy(shapes.torus(20000, major=1.0, minor=0.15), 0.06))
    assert np.median(found.level) == pytest.approx(0.06, rel=0.2)


def test_a_sample_far_off_counts_as_noisy_as_those_around():
    points = np.vstack([noisy(shapes.scattered_sphere(2400), 0.1), [[1.7, 0, 0]]])
    level = estimate_noise(points).level
    assert level[-1] > 0.6 * np.median(level)


@pytest.mark.parametrize("samples", [200, 800])
def test_the_share_of_noise_that_quadrics_follow(samples):
    """On a plane, read back as a level; singly and by clusters."""
    points = shapes.square(20000)
    for share in (0.08, 0.17, 0.25):
        radius = np.sqrt(4 * samples / len(points) / np.pi)
        seen = noisy(points, share * radius)
        rows = np.flatnonzero(np.abs(seen[:, :2]).max(axis=1) < 0.6)[:1500]
        fit = fit_quadrics(seen, rows, samples)
        left = np.sqrt(np.mean(fit.left_out() ** 2) * (1 - np.median(fit.leverage)))
        found = in_full(np.array([[left]]), np.array([[np.median(fit.radius)]]), np.zeros(1, int))
        assert found[0] == pytest.approx(share * radius, rel=0.06)


def test_estimates_follow_the_scale():
    points = noisy(shapes.scattered_sphere(2000), 0.02)
    here, there = estimate_noise(points), estimate_noise(4 * points)
    np.testing.assert_allclose(there.level, 4 * here.level, rtol=1e-6)
    np.testing.assert_allclose(there.neighbours, here.neighbours, rtol=1e-6)


def range_image(across: int, down: int) -> np.ndarray:
    """A ball seen by a pinhole camera at (0, 0, 5), with noise along the rays, turned."""
    x, y = np.meshgrid(np.linspace(-0.21, 0.21, across), np.linspace(-0.21, 0.21, down))
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    towards = -5 * rays[:, 2]
    hit = towards**2 > 24
    rays, depth = rays[hit], towards[hit] - np.sqrt(towards[hit] ** 2 - 24)
    depth += 0.3 * 0.42 * 4 / np.sqrt(across * down) * np.random.default_rng(0).normal(size=len(depth))
    return (np.array([0, 0, 5]) + depth[:, None] * rays) @ shapes.random_rotation(1)


@pytest.mark.parametrize("pixels", [(110, 110), (200, 80)])
def test_noise_along_the_rays_of_a_scanner_is_noise(pixels):
    """Each row and column of the picture stays in a plane with the eye, as samples on faces do."""
    points = range_image(*pixels)
    assert noisy_samples(points, local_spacing(points)).all()


def test_faces_that_meet_in_points_are_faces():
    """Those of a torus between two circles of latitude meet on its axis."""
    turn, tilt = np.meshgrid(np.arange(96) * np.pi / 48, np.arange(24) * np.pi / 12)
    corner = np.stack([turn, tilt], axis=-1)
    radius = 1 + 0.25 * np.cos(corner[..., 1])
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.25 * np.sin(tilt)], axis=-1)[::2, ::2]
    below, beside = np.roll(ring, 1, axis=0), np.roll(ring, 1, axis=1)
    middle = (ring + below + beside + np.roll(below, 1, axis=1)) / 4
    points = np.concatenate([each.reshape(-1, 3) for each in (ring, (ring + below) / 2, (ring + beside) / 2, middle)])
    points = points @ shapes.random_rotation(1)
    assert not noisy_samples(points, local_spacing(points)).any()
