"""Against numpy.linalg."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core.linalg import (
    conjugate_gradients,
    eigenvalues,
    inner,
    laplacian_symbol,
    medians,
    outer,
    principal_axes,
    shortened,
    solve_positive,
    tangent_frames,
    unit,
    unit_columns,
)
from tests.shapes import random_rotation


def matrices(tensors):
    return tensors[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)


def components(matrix):
    return matrix[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def residual(tensors):
    """|A v - lambda v| relative to the size of A, largest lambda by eigh."""
    axes, values = principal_axes(tensors), eigenvalues(tensors)
    full = matrices(tensors)
    expected = np.linalg.eigvalsh(full)[:, ::-1]
    size = np.maximum(np.abs(expected).max(axis=1), np.finfo(float).tiny)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(values / size[:, None], expected / size[:, None], atol=1e-7)
    assert (np.diff(values, axis=1) <= 1e-7 * size[:, None]).all()
    off = np.einsum("mij,mj->mi", full, axes) - expected[:, :1] * axes
    return np.linalg.norm(off, axis=1) / size


def test_outer_is_v_v_transposed(random):
    v = random.normal(size=(4, 5, 3))
    np.testing.assert_allclose(matrices(outer(v).reshape(-1, 6)), (v[..., None] * v[..., None, :]).reshape(-1, 3, 3))


@pytest.mark.parametrize("size", [1e-320, 1e-200, 1e-169, 1e-155, 1e-150, 1e-3, 1e150])
def test_unit_vectors_are_no_longer_than_one(size, random):
    """Nor those whose squared length is no number above zero; all others are as long as that."""
    v = size * random.normal(size=(100, 3))
    for found in (unit(v), unit_columns(v.T).T):
        length = np.linalg.norm(found, axis=1)
        assert np.isfinite(found).all()
        assert (length < 1 + 1e-12).all()
        if size >= 1e-150:
            np.testing.assert_allclose(length, 1, rtol=1e-12)
    assert not unit(np.zeros(3)).any()
    assert not unit_columns(np.zeros((3, 2))).any()


def test_random_tensors(random):
    assert residual(random.normal(size=(10000, 6))).max() < 1e-6


@pytest.mark.parametrize("factor", [1e-60, 1e-12, 1e12, 1e60])
def test_any_scale(factor, random):
    tensors = random.normal(size=(500, 6))
    assert residual(tensors * factor).max() < 1e-6


@pytest.mark.parametrize(
    "eigenvalues",
    [(1, 0, 0), (1, 1, 0), (0, 0, -1), (3, 2, 2), (3, 3, 3), (0, 0, 0), (-1, -2, -3), (3, 3 - 1e-9, 2), (1, 1e-9, 0)],
)
def test_repeated_and_nearly_repeated_eigenvalues(eigenvalues):
    rotations = np.stack([np.eye(3), *(random_rotation(seed) for seed in range(200))])
    tensors = components(rotations @ np.diag(np.array(eigenvalues, float)) @ rotations.transpose(0, 2, 1))
    assert residual(tensors).max() < 1e-6


@given(arrays(np.float64, (3, 6), elements=st.sampled_from([0.0, 1.0, -1.0, 0.5, 1e-8, -1e-8, 1e-16, 3.0])))
def test_awkward_tensors(tensors):
    assert residual(tensors).max() < 1e-6


def test_a_well_separated_axis_is_the_one_of_eigh(random):
    axis = random.normal(size=(1000, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    noise = random.normal(size=(1000, 6))
    found = principal_axes(10 * outer(axis) + 0.1 * noise)
    expected = np.linalg.eigh(matrices(10 * outer(axis) + 0.1 * noise))[1][:, :, 2]
    np.testing.assert_allclose(np.abs(np.einsum("mi,mi->m", found, expected)), 1, atol=1e-12)


@pytest.mark.parametrize("tilt", [1e-6, 1e-9, 1e-12, 1e-15])
def test_axes_almost_along_a_coordinate(tilt):
    vectors = np.concatenate([np.roll([1.0, tilt, 2 * tilt], k)[None] for k in range(3)])
    assert residual(3 * outer(vectors) + components(np.diag([0.3, 0.2, 0.1]))).max() < 1e-9


def test_no_tensors_give_no_axes():
    assert principal_axes(np.empty((0, 6))).shape == eigenvalues(np.empty((0, 6))).shape == (0, 3)


@pytest.mark.parametrize("k", [1, 3, 6])
@pytest.mark.parametrize("stiffness", [1.0, 1e-6])
def test_positive_systems(k, stiffness, random):
    rows = random.normal(size=(2000, k - 1 if k > 1 else 1, k))  # alone they leave a direction free
    matrices = rows.transpose(0, 2, 1) @ rows + stiffness * np.eye(k)
    right = random.normal(size=(2000, k))
    kept = matrices.copy(), right.copy()
    found = solve_positive(matrices, right)
    expected = np.linalg.solve(matrices, right[..., None])[..., 0]
    error = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert error.max() < 1e-12 / stiffness
    np.testing.assert_array_equal(matrices, kept[0])
    np.testing.assert_array_equal(right, kept[1])


def test_no_systems():
    assert solve_positive(np.empty((0, 3, 3)), np.empty((0, 3))).shape == (0, 3)


def test_sum_of_products(random):
    a, b = random.normal(size=(2, 30, 40, 5))
    assert inner(a, b) == pytest.approx(np.vdot(a, b), rel=1e-12)


def test_frames_are_orthonormal(random):
    normals = np.concatenate([random.normal(size=(100, 3)), np.eye(3), -np.eye(3)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    axes = np.concatenate([normals[:, None], tangent_frames(normals)], axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-12)


def test_long_vectors_are_shortened_and_short_ones_stay():
    steps = np.array([[3.0, 4.0, 0.0], [0.3, 0.4, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(shortened(steps, 1.0), [[0.6, 0.8, 0.0], steps[1], steps[2]], atol=1e-15)
    np.testing.assert_array_equal(shortened(steps, np.array([5.0, 0.5, 0.0])), steps)


def solved(matrix, right, tolerance, steps, start=None):
    start = np.zeros_like(right) if start is None else start
    diagonal = np.diag(matrix).reshape(right.shape)
    apply = lambda u: (matrix @ u.ravel()).reshape(u.shape)  # noqa: E731
    return conjugate_gradients(apply, right, start, lambda residual: residual / diagonal, tolerance, steps)


def test_medians_leave_out_what_is_not_there(random):
    rows = random.normal(size=(200, 9))
    rows[random.random(rows.shape) < 0.5] = np.nan
    rows[0], rows[1, 1:], rows[2] = np.nan, np.nan, np.arange(9.0)
    found = medians(rows)
    assert np.isnan(found[0])
    np.testing.assert_array_equal(found[1:], np.nanmedian(rows[1:], axis=1))
    assert medians(np.empty((0, 4))).shape == (0,)


def test_conjugate_gradients_solve_until_the_residual_is_small(random):
    half, right = random.normal(size=(60, 60)), random.normal(size=(3, 4, 5))
    matrix, seen = half @ half.T + 5 * np.eye(60), []
    found = solved(matrix, right, 1e-10, (seen.append(k) for k in range(500)))
    np.testing.assert_allclose(matrix @ found.ravel(), right.ravel(), atol=1e-8)
    assert 10 < len(seen) < 120
    rough = solved(matrix, right, 0.1, range(500))
    residual = np.linalg.norm(matrix @ rough.ravel() - right.ravel()) / np.linalg.norm(right)
    assert 1e-4 < residual <= 0.1


def test_conjugate_gradients_end_with_their_steps_and_where_there_is_nothing_to_do(random):
    half, right = random.normal(size=(30, 30)), random.normal(size=30)
    matrix = half @ half.T + np.eye(30)
    start = np.linalg.solve(matrix, right)
    np.testing.assert_array_equal(solved(matrix, right, 0.0, range(0), start), start)
    np.testing.assert_array_equal(solved(matrix, right, 1e-6, range(50), start), start)
    np.testing.assert_array_equal(solved(matrix, 0 * right, 1e-6, range(50)), 0)


def test_the_symbol_is_that_of_the_graph_of_a_grid():
    shape = (3, 4, 2)
    index, laplacian = np.arange(24).reshape(shape), np.zeros((24, 24))
    for axis in range(3):
        low, high = (np.delete(index, end, axis).ravel() for end in (-1, 0))
        np.add.at(laplacian, (low, low), 1)
        np.add.at(laplacian, (high, high), 1)
        np.add.at(laplacian, (np.append(low, high), np.append(high, low)), -1)
    np.testing.assert_allclose(np.sort(laplacian_symbol(shape).ravel()), np.linalg.eigvalsh(laplacian), atol=1e-12)
