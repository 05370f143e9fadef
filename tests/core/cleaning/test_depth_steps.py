import numpy as np
import pytest

from core import Cancelled, Settings, reconstruct
from core.cleaning.clean import clean
from core.cleaning.depth_steps import Frame, between_steps, find_frame
from core.points import prepare_samples

PIXEL, STEP = 0.01, 0.006


def rays(width=80):
    """Through the pixels of a picture, (n,3), at depth 1 along the third axis."""
    x, y = np.meshgrid(*2 * [PIXEL * (np.arange(width) - (width - 1) / 2)])
    return np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)


def corner(x, y):
    """Depth of a wall seen askew and of a floor, whichever is closer along a ray."""
    return np.minimum(3.0 / (1 + 0.8 * x), 1.0 / np.maximum(y + 0.1, 1e-3))


def frame(step=STEP, noise=0.3):
    """Points of a depth camera before a corner, and the same without steps and noise."""
    ray = rays()
    true = corner(*ray[:, :2].T)
    ray, true = ray[true < 6], true[true < 6]
    disparity = 1 / (step * true) + noise * np.random.default_rng(0).normal(size=len(true))
    return ray / (step * np.rint(disparity)[:, None]), ray * true[:, None]


def off_the_corner(points):
    """Distance of points to the closer of wall and floor."""
    x, y, z = points.T
    return np.minimum(np.abs(z + 0.8 * x - 3.0) / np.hypot(1, 0.8), np.abs(y + 0.1 * z - 1.0) / np.hypot(1, 0.1))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_frame_is_found_whichever_way_the_camera_looks(axis, sign):
    points = np.roll(frame()[0], axis + 1, axis=1)
    points[:, axis] *= sign
    found = find_frame(points)
    assert (found.axis, found.sign) == (axis, sign)
    assert found.pixel == pytest.approx(PIXEL, rel=1e-6)
    assert found.step == pytest.approx(STEP, rel=1e-6)


def test_depths_rounded_to_millimetres_are_in_steps_still():
    points = frame()[0]
    points = (points / points[:, 2:] * np.round(points[:, 2:], 3)).astype(np.float32)
    assert find_frame(points.astype(np.float64)).step == pytest.approx(STEP, rel=0.02)


def test_pixels_that_see_nothing_are_at_the_origin_and_stay_there():
    points = frame()[0]
    moved, found = between_steps(np.vstack([np.zeros((1, 3)), points]))
    assert found == find_frame(points)
    np.testing.assert_array_equal(moved[0], 0)
    np.testing.assert_array_equal(moved[1:], between_steps(points)[0])


def contours(levels):
    turn = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    return np.concatenate([[(h * np.cos(t), h * np.sin(t), h) for t in turn] for h in levels])


def lattice():
    x, y, z = (each.ravel() for each in np.meshgrid(*3 * [np.arange(1.0, 25.0)]))
    near = np.abs(np.sqrt((x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2) - 9) < 1
    return np.stack([x, y, z], axis=1)[near]


@pytest.mark.parametrize(
    "points",
    [
        frame()[1],
        contours(np.linspace(1, 4, 30)),
        contours(1 / np.linspace(0.25, 1, 30)),
        lattice(),
        frame()[0] - [0, 0, 4],
        frame()[0] + [0, 0, 3],
        np.random.default_rng(0).normal(size=(2000, 3)) + 5,
    ],
    ids=["without steps", "contours", "contours at such levels", "lattice", "around the origin", "aside", "a cloud"],
)
def test_what_is_no_frame_stays_to_the_bit(points):
    moved, found = between_steps(points)
    assert moved is points
    assert found is None


def test_pixels_and_steps_are_taken_back_to_space():
    points = frame()[0]
    camera = Frame(2, 1.0, PIXEL, STEP)
    seen = camera.seen(points)
    assert np.abs(seen[:, 2] - np.rint(seen[:, 2])).max() < 1e-9
    np.testing.assert_allclose(camera.in_space(seen), points, rtol=1e-12)


@pytest.mark.parametrize(("noise", "share"), [(0.0, 0.5), (0.3, 0.35)])
def test_points_come_closer_to_the_surface_and_none_goes_far(noise, share):
    points, _ = frame(noise=noise)
    moved, camera = between_steps(points)
    assert off_the_corner(moved).mean() < share * off_the_corner(points).mean()
    assert np.linalg.norm(camera.seen(moved) - camera.seen(points), axis=1).max() < 2 + 1e-9


def test_the_farthest_stay_before_the_camera():
    rng = np.random.default_rng(0)
    patches = rng.integers(1, 20, (8, 8)).repeat(10, axis=0).repeat(10, axis=1).ravel()
    points = rays() / (0.01 * np.where(rng.random(len(patches)) < 0.05, 1, patches)[:, None])
    moved, camera = between_steps(points)
    assert camera is not None
    assert (moved[:, 2] > 0).all()
    assert (moved[:, 2] < 2.001 * points[:, 2]).all()


def test_a_run_says_so_and_denoise_at_0_leaves_them():
    points = frame()[0]
    samples = prepare_samples(points)
    cleaned, done = clean(samples)
    assert done["depth_step"] == pytest.approx(STEP * points[:, 2].max() ** 2)
    assert any("depth is in steps" in warning for warning in cleaned.warnings)
    assert off_the_corner(cleaned.given).mean() < 0.4 * off_the_corner(samples.given).mean()
    kept, done = clean(samples, Settings(denoise=0, outliers=False))
    assert kept is samples
    assert "depth_step" not in done
    half, _ = clean(samples, Settings(denoise=0.5, outliers=False))
    assert off_the_corner(half.given).mean() > 1.2 * off_the_corner(cleaned.given).mean()


def test_terraces_become_one_sheet():
    points, _ = frame(step=0.01, noise=0.0)
    borders = [
        reconstruct(points, Settings(resolution=64, surface="single", denoise=strength)).sheet.border_loops()
        for strength in (0, "auto")
    ]
    assert borders[0] > 5
    assert borders[1] <= 2


def test_can_be_cancelled():
    with pytest.raises(Cancelled):
        between_steps(frame()[0], lambda fraction, text: fraction < 0.3)


def test_no_point_moves_by_more_than_two_steps():
    points = frame()[0]
    some = np.arange(50, len(points), 400)
    disparity = 1 / (STEP * points[some, 2])
    points[some] *= (disparity / np.maximum(disparity - 10, 3))[:, None]  # ten steps behind those around
    moved, found = between_steps(points)
    assert np.linalg.norm(found.seen(moved) - found.seen(points), axis=1).max() <= 2 + 1e-9


def test_points_behind_the_camera_as_well_are_of_none():
    before = frame()[0]
    before = before[before[:, 0] > 0]
    assert find_frame(np.vstack([before, before * [1, 1, -1]])) is None
