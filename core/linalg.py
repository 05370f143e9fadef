"""Principal axes of many symmetric 3x3 tensors at once, in closed form.

A tensor is stored as six components (xx, yy, zz, xy, xz, yz) along the last axis.
"""

import numpy as np

_DISTINCT = 1e-5  # below this the two largest eigenvalues are too close for the closed form

COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def outer(vectors: np.ndarray) -> np.ndarray:
    """v v^T, (...,3) -> (...,6)."""
    products = np.empty((*vectors.shape[:-1], len(COMPONENTS)), vectors.dtype)
    for c, (i, j) in enumerate(COMPONENTS):
        np.multiply(vectors[..., i], vectors[..., j], out=products[..., c])
    return products


def principal_axes(tensors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit eigenvector of the largest eigenvalue, (m,6) -> (m,3), and all eigenvalues in falling order, (m,3).

    Trigonometric solution of the characteristic cubic (O. K. Smith, Comm. ACM 4(4), 1961); the axis is the longest
    cross product of two rows of A - lambda_1 I. Where the two largest eigenvalues coincide any axis of their plane may
    come back; a multiple of the identity gives the x axis.
    """
    xx, yy, zz, xy, xz, yz = tensors.T
    mean = (xx + yy + zz) / 3
    dx, dy, dz = xx - mean, yy - mean, zz - mean
    spread = np.sqrt((dx * dx + dy * dy + dz * dz + 2 * (xy * xy + xz * xz + yz * yz)) / 6)
    safe = np.where(spread > 0, spread, 1.0)
    determinant = dx * (dy * dz - yz * yz) - xy * (xy * dz - yz * xz) + xz * (xy * yz - dy * xz)
    angle = np.arccos(np.clip(determinant / (2 * safe**3), -1, 1)) / 3
    first = mean + 2 * spread * np.cos(angle)
    last = mean + 2 * spread * np.cos(angle + 2 * np.pi / 3)
    values = np.stack([first, 3 * mean - first - last, last], axis=1)

    ax, ay, az = (xx - first) / safe, (yy - first) / safe, (zz - first) / safe
    bxy, bxz, byz = xy / safe, xz / safe, yz / safe
    crosses = np.stack(
        [
            np.stack([bxy * byz - bxz * ay, bxz * bxy - ax * byz, ax * ay - bxy * bxy], axis=1),
            np.stack([bxy * az - bxz * byz, bxz * bxz - ax * az, ax * byz - bxy * bxz], axis=1),
            np.stack([ay * az - byz * byz, byz * bxz - bxy * az, bxy * byz - ay * bxz], axis=1),
        ],
        axis=1,
    )
    lengths = np.einsum("ijk,ijk->ij", crosses, crosses)
    best = lengths.argmax(axis=1)
    every = np.arange(len(tensors))
    axes = crosses[every, best]
    length = np.sqrt(lengths[every, best])
    found = length > _DISTINCT
    axes[found] /= length[found, None]
    axes[~found] = _by_lapack(tensors[~found])
    return axes, values


def _by_lapack(tensors):
    matrices = tensors[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    return np.linalg.eigh(matrices)[1][:, :, 2]
