import numpy as np
import pytest

from core.field.curvature import _ALIGNED, _ONE_SHEET, _STIFFNESS, _WIDTH, bending
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes


def forms(points, normals):
    cloud = Cloud.of(points, normals, local_spacing(points))
    return bending(cloud, alone(cloud)), cloud.spacing


def alone(cloud):
    """The room of samples on one sheet that has no other beside it."""
    return np.full(len(cloud), np.inf)


def tangential(normals):
    return np.eye(3) - normals[:, :, None] * normals[:, None, :]


@pytest.mark.parametrize("radius", [0.5, 2.0, 30.0])
def test_a_sphere_bends_alike_in_every_direction(radius):
    points = shapes.sphere(1000, radius)
    form, _ = forms(points, points / radius)
    np.testing.assert_allclose(form * radius, -tangential(points / radius), atol=0.05)


def test_a_cylinder_bends_round_but_not_along():
    points = shapes.cylinder(2000)
    normals = points * [1, 1, 0]
    form, _ = forms(points, normals)
    middle = np.abs(points[:, 2]) < 0.8
    around = np.cross(normals, [0, 0, 1])
    np.testing.assert_allclose(form[middle], -(around[:, :, None] * around[:, None, :])[middle], atol=0.05)


def test_a_saddle_bends_both_ways():
    points = shapes.square(1500)
    x, y, _ = points.T
    points = np.column_stack([x, y, (x**2 - y**2) / 2])
    normals = np.column_stack([-x, y, np.ones_like(x)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    form, _ = forms(points, normals)
    middle = np.hypot(x, y) < 0.1
    np.testing.assert_allclose(form[middle], np.broadcast_to(np.diag([1.0, -1, 0]), form[middle].shape), atol=0.1)


def test_a_plane_does_not_bend():
    points = shapes.disc(300)
    form, _ = forms(points, np.tile([0.0, 0.0, 1.0], (300, 1)))
    np.testing.assert_allclose(form, 0, atol=1e-9)


def test_follows_its_own_normals_sign_and_no_other(random):
    points = shapes.sphere(500)
    form, _ = forms(points, points)
    sign = random.choice([-1.0, 1.0], 500)
    flipped, _ = forms(points, points * sign[:, None])
    np.testing.assert_allclose(flipped, form * sign[:, None, None], atol=1e-9)


def test_lies_in_the_tangent_plane_and_is_symmetric(random):
    points = shapes.scattered_sphere(300)
    normals = points + 0.2 * random.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    form, _ = forms(points, normals)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", form, normals), 0, atol=1e-9)
    np.testing.assert_allclose(form, form.transpose(0, 2, 1), atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_is_never_tighter_than_the_spacing(seed):
    random = np.random.default_rng(seed)
    points, normals = random.normal(size=(2, 200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    form, spacing = forms(points, normals)
    assert (np.linalg.norm(form, axis=(1, 2)) * spacing).max() < 1 + 1e-9


def test_forms_solve_the_weighted_equations(random):
    """Against NumPy's least squares on the equations as they are written, for rough samples and tilted normals."""
    points = random.uniform(-1, 1, (60, 3)) * [1, 1, 0.2]
    normals = random.normal(size=(60, 3)) * 0.3 + [0, 0, 1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    spacing = random.uniform(0.2, 0.4, 60)
    cloud = Cloud.of(points, normals, spacing)
    form, frames = bending(cloud, alone(cloud)), cloud.frames
    for i, others in enumerate(cloud.neighbours):
        rows, values = [np.sqrt(_STIFFNESS) * spacing[i] * np.eye(3)], [np.zeros(3)]
        for j in others:
            step, agreement = points[j] - points[i], normals[i] @ normals[j]
            if abs(agreement) <= _ALIGNED:
                continue
            x, y = frames[i] @ step
            z, back, length = step @ normals[i], step @ normals[j], np.linalg.norm(step)
            decay = (length / (_WIDTH * spacing[i])) ** 2 + _ONE_SHEET * (z**2 + back**2) / length**2
            slope = -(frames[i] @ normals[j]) / agreement
            weight = np.exp(-decay / 2)
            rows.append(weight * np.array([[x * x / length, 2 * x * y / length, y * y / length], [x, y, 0], [0, x, y]]))
            values.append(weight * np.array([2 * z / length, *slope]))
        xx, xy, yy = np.linalg.lstsq(np.concatenate(rows), np.concatenate(values), rcond=None)[0]
        expected = np.array([[xx, xy], [xy, yy]])
        expected *= min(1.0, 1 / (np.linalg.norm(expected) * spacing[i]))
        np.testing.assert_allclose(form[i], frames[i].T @ expected @ frames[i], atol=1e-6)


def test_samples_of_a_sheet_beside_do_not_bend_it(random):
    points = random.uniform(-1, 1, (1000, 3)) * [1, 1, 0]
    points[::2, 2] = 0.03
    cloud = Cloud.of(points, np.tile([0.0, 0.0, 1.0], (1000, 1)), local_spacing(points))
    assert np.abs(bending(cloud, alone(cloud))).max() > 1
    np.testing.assert_allclose(bending(cloud, np.full(1000, 0.015)), 0, atol=1e-9)
