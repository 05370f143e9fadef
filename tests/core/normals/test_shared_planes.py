import numpy as np
import pytest

from core.normals.around import Around
from core.normals.shared_planes import onto_shared_planes
from core.points import local_spacing
from tests import shapes
from tests.core.normals.test_creases import degrees, off_all_faces, parted, roof, scattered_cube, swept


def moved_from(points, axes, free=None):
    spacing, mirrors, _ = swept(points)
    free = np.ones(len(points), bool) if free is None else free
    return onto_shared_planes(Around(points, spacing), mirrors, axes, free)


def random_axes(count, rng):
    axes = rng.normal(size=(count, 3))
    return axes / np.linalg.norm(axes, axis=1)[:, None]


@pytest.mark.parametrize("angle", [50, 90, 120])
def test_wrong_axes_beside_a_crease_go_to_the_sheet_the_sample_lies_on(angle, random):
    points, truth, away = roof(np.radians(angle))
    wrong = away < 0.5 * np.median(local_spacing(points))
    either_way = truth * random.choice([-1, 1], (len(points), 1))
    axes = np.where(wrong[:, None], random_axes(len(points), random), either_way)
    found, moved = moved_from(points, axes)
    assert moved[wrong].mean() > 0.97
    assert (degrees(found, truth)[wrong] < 1e-4).mean() > 0.95
    assert not moved[~wrong].any()
    np.testing.assert_array_equal(found[~moved], axes[~moved])


def test_a_sample_may_get_its_plane_from_one_that_has_got_it_just_now(random):
    points = shapes.square(900)
    axes = np.tile([0, 0, 1.0], (len(points), 1))
    wrong = np.linalg.norm(points[:, :2], axis=1) < 8 * np.median(local_spacing(points))
    axes[wrong] = random_axes(wrong.sum(), random)
    found, moved = moved_from(points, axes)
    far = np.linalg.norm(points[:, :2], axis=1) < 4 * np.median(local_spacing(points))
    assert moved[far].any()
    np.testing.assert_allclose(np.abs(found[moved, 2]), 1.0)


def test_samples_that_are_not_free_stay(random):
    points, truth, away = roof(np.pi / 2)
    axes = np.where((away < 0.02)[:, None], random_axes(len(points), random), truth)
    free = random.random(len(points)) < 0.5
    found, moved = moved_from(points, axes, free)
    assert moved[free].any()
    assert not moved[~free].any()
    assert found[~free].tobytes() == axes[~free].tobytes()


@pytest.mark.parametrize("points", [shapes.scattered_sphere(2000), shapes.torus(1500)])
def test_hardly_a_sample_moves_on_curved_surfaces(points, random):
    swept_axes = swept(points)[2]
    assert not moved_from(points, swept_axes)[1].any()
    wrong = random.random(len(points)) < 0.2
    axes = np.where(wrong[:, None], random_axes(len(points), random), swept_axes)
    assert moved_from(points, axes)[1].mean() < 0.01


def test_a_straight_line_tells_no_plane():
    """All of its samples lie in every plane along it: lines on a cylinder, one sample of each turned about its line."""
    angle, z = np.meshgrid(np.arange(12) * np.pi / 6, np.linspace(0, 2, 61))
    points = np.column_stack([np.cos(angle.ravel()), np.sin(angle.ravel()), z.ravel()])
    turned = np.abs(z.ravel() - 1.0) < 0.02
    angle = angle.ravel() + np.where(turned, 0.3, 0.0)
    axes = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert turned.sum() == 12
    assert not moved_from(points, axes)[1].any()


def test_hardly_a_random_sample_of_a_cube_has_the_normal_of_none_of_its_faces():
    points, truth = scattered_cube(3000)
    axes = parted(points)[1]
    assert (off_all_faces(axes) > 1).mean() < 0.01
    assert (degrees(axes, truth) > 10).mean() < 0.003
