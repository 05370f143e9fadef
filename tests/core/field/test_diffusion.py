"""Against a dense sum of Yukawa kernels over all samples, opposite sources set apart by a finite distance."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from core.field.diffusion import DIFFUSION_LENGTH, fused_axes, kernel_weights
from tests import shapes

N = 1000
SPACING = 0.1


def fused(points, normals, x, k, spacing=SPACING):
    distance, sample = KDTree(points).query(x, k=k)
    height = np.einsum("mki,mki->mk", x[:, None] - points[sample], normals[sample])
    weight, pull = kernel_weights(distance, np.broadcast_to(spacing, len(points))[sample], height)
    return fused_axes(weight, pull, np.moveaxis(normals[sample], 2, 0))


def dense(points, normals, x, spacing=SPACING, apart=1e-4):
    """Y_f by the paper's definition, one query at a time."""
    root_t = DIFFUSION_LENGTH * spacing

    def kernel(source, query):
        r = np.linalg.norm(query - source, axis=1)
        return np.exp(-r / root_t) / r

    axes = []
    for query in x:
        tensor = np.einsum("n,ni,nj->ij", kernel(points, query), normals, normals)
        pair = kernel(points + apart * normals, query) - kernel(points - apart * normals, query)
        axis = np.linalg.eigh(tensor)[1][:, 2]
        axes.append(axis * np.sign(axis @ (pair @ normals)))
    return np.array(axes)


@pytest.fixture
def samples(random):
    """A torus with its normals, and queries around it."""
    points = shapes.torus(N)
    ring = points * [1, 1, 0] / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    normals = (points - ring) / 0.4
    return points, normals, points[::5] + 0.15 * random.normal(size=(N // 5, 3))


def test_over_all_samples_it_is_the_dense_sum(samples):
    np.testing.assert_allclose(fused(*samples, k=N), dense(*samples), atol=2e-4)


def test_between_two_sheets_the_sign_turns_where_that_of_the_dense_sum_does(random):
    points = shapes.sheets(400, gap=0.2)
    normals = np.tile([0.0, 0.0, 1.0], (400, 1))
    x = random.uniform([-0.8, -0.8, -0.04], [0.8, 0.8, 0.04], (1000, 3))
    np.testing.assert_allclose(fused(points, normals, x, k=400), dense(points, normals, x), atol=1e-6)


def test_the_nearest_samples_are_enough(samples):
    cosine = np.einsum("mi,mi->m", fused(*samples, k=32), dense(*samples))
    assert np.degrees(np.arccos(np.median(cosine))) < 0.5
    assert cosine.min() > 0.98


def test_points_away_from_the_surface(samples):
    points, normals, x = samples
    off = shapes.torus_distance(x)
    near = (off > 0.05) & (off < 0.2)
    _, nearest = KDTree(points).query(x)
    away = np.einsum("mi,mi->m", fused(points, normals, x, k=32), x - points[nearest])
    assert near.sum() > 50
    assert away[near].min() > 0


def test_flipping_any_normals_changes_nothing(samples, random):
    points, normals, x = samples
    flipped = normals * random.choice([-1.0, 1.0], (N, 1))
    np.testing.assert_allclose(fused(points, flipped, x, k=12), fused(points, normals, x, k=12), atol=1e-9)


def test_far_away_it_neither_underflows_nor_loses_the_direction():
    x = np.array([[0.0, 0.0, 60.0], [0.0, -60.0, 0.0]])
    points = shapes.sphere(N)
    axes = fused(points, points, x, k=32)
    np.testing.assert_allclose(axes, x / 60, atol=0.1)


def test_density_does_not_vote():
    """Halfway between a dense floor and a sparse wall, each sample counts for the area it stands for."""
    weight, _ = kernel_weights(np.array([[1.0, 1.0]]), np.array([[0.1, 0.2]]), np.zeros((1, 2)))
    assert weight[0, 1] / weight[0, 0] == pytest.approx(4)


def test_weights_fall_with_distance():
    distance = np.array([[0.1, 0.2, 0.3]])
    height = np.array([[0.1, -0.1, 0.05]])
    weight, pull = kernel_weights(distance, np.full((1, 3), 0.1), height)
    length = 0.1 * DIFFUSION_LENGTH
    expected = np.exp(-distance / length) / distance
    np.testing.assert_allclose(weight / weight[:, :1], expected / expected[:, :1], rtol=1e-5)
    slope = (1 / distance + 1 / length) * height / distance
    np.testing.assert_allclose(pull, slope, rtol=1e-5)
