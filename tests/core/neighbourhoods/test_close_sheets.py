import numpy as np
import pytest

from core.neighbourhoods.close_sheets import sheet_room
from core.neighbourhoods.cloud import Cloud
from core.normals.estimate import estimate_normals
from core.points import local_spacing
from tests import shapes

UP = np.array([0.0, 0.0, 1.0])


def room_of(points, normals):
    """In local spacings, and those."""
    spacing = local_spacing(points)
    return sheet_room(Cloud.of(points, np.broadcast_to(normals, points.shape), spacing)) / spacing, spacing


def wall(thickness, random, count=2000):
    """Two sheets so many local spacings apart, which are some 1.5 / sqrt(count), bent like a wave."""
    points = random.uniform(-1, 1, (2 * count, 3)) * [1, 1, 0]
    x, y, _ = points.T
    points[:, 2] = 0.1 * np.sin(3 * x) * np.cos(2 * y)
    slope = np.column_stack(
        [-0.3 * np.cos(3 * x) * np.cos(2 * y), 0.2 * np.sin(3 * x) * np.sin(2 * y), np.ones_like(x)]
    )
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    points[count:] += thickness * 1.5 / np.sqrt(count) * normals[count:]
    return points, normals


@pytest.mark.parametrize("thickness", [0.2, 0.4, 0.7])
def test_half_the_distance_of_two_sheets_is_told_at_each_sample(thickness, random):
    points, normals = wall(thickness, random)
    room, spacing = room_of(points, normals * random.choice([-1, 1], (len(points), 1)))
    expected = 0.5 * thickness * 1.5 / np.sqrt(len(points) / 2) / spacing
    assert np.isfinite(room).mean() > 0.97
    assert np.percentile(np.abs(room / expected - 1)[np.isfinite(room)], 90) < 0.1


def test_concentric_spheres_have_room_by_the_difference_of_their_radii():
    points = np.concatenate([shapes.scattered_sphere(2000), 1.02 * shapes.scattered_sphere(2000, seed=1)])
    room, spacing = room_of(points, points / np.linalg.norm(points, axis=1, keepdims=True))
    assert np.isfinite(room).mean() > 0.97
    np.testing.assert_allclose(np.median(room * spacing), 0.01, rtol=0.05)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_a_single_sheet_has_all_the_room_even_if_it_is_rough(noise, random):
    points = shapes.scattered_sphere(2000)
    spacing = local_spacing(points)
    noisy = points + noise * spacing[:, None] * random.normal(size=points.shape)
    assert np.isinf(room_of(noisy, points)[0]).mean() > 0.99


def test_lines_of_samples_are_no_sheets_beside_each_other(random):
    """The next line is as far off as a sheet would be, where normals err, but lies beside and not above."""
    x, y = np.repeat(np.linspace(0, 1, 25), 160), random.uniform(size=4000)
    points = np.column_stack([x, y, 0.15 * np.sin(6 * x) * np.cos(5 * y)])
    normals, _, _ = estimate_normals(points, local_spacing(points))
    assert np.isinf(room_of(points, normals)[0]).all()


def test_sheets_farther_than_a_spacing_are_not_asked_for(random):
    assert np.isinf(room_of(*wall(2.5, random))[0]).all()


@pytest.mark.parametrize("count", [4, 6, 8])
def test_a_handful_of_samples_has_all_the_room(count):
    assert np.isinf(room_of(shapes.disc(count), UP)[0]).all()
