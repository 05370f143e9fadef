"""Principal axes of many symmetric 3x3 tensors at once, in closed form; products and lengths of vectors; many small
systems, and large sparse ones.

A tensor is stored as six components (xx, yy, zz, xy, xz, yz) along the last axis. With another number of threads BLAS
and LAPACK round differently, OpenBLAS even in systems of three equations, so what places and directions come from is
summed and solved here.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

_DISTINCT = 1e-5  # below this the two largest eigenvalues are too close for the closed form
_SHORTEST = np.sqrt(np.finfo(float).tiny)  # of vectors, below which squared lengths are lost

COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def outer(vectors: np.ndarray) -> np.ndarray:
    """v v^T, (...,3) -> (...,6)."""
    products = np.empty((*vectors.shape[:-1], len(COMPONENTS)), vectors.dtype)
    for c, (i, j) in enumerate(COMPONENTS):
        np.multiply(vectors[..., i], vectors[..., j], out=products[..., c])
    return products


def principal_axes(tensors: np.ndarray) -> np.ndarray:
    """Unit eigenvectors of the largest eigenvalues of tensors (m,6), (m,3).

    Every column of the adjugate of A - lambda_1 I is along the axis; the one with the largest diagonal element is the
    longest. Where the two largest eigenvalues coincide any axis of their plane may come back; a multiple of the
    identity gives any.
    """
    xx, yy, zz, xy, xz, yz = columns = np.ascontiguousarray(tensors.T)
    mean, spread, angle = _roots(columns)
    first, safe = mean + 2 * spread * np.cos(angle), np.where(spread > 0, spread, 1.0)
    ax, ay, az = (xx - first) / safe, (yy - first) / safe, (zz - first) / safe
    bxy, bxz, byz = xy / safe, xz / safe, yz / safe
    cxx, cyy, czz = ay * az - byz * byz, ax * az - bxz * bxz, ax * ay - bxy * bxy
    cxy, cxz, cyz = bxz * byz - bxy * az, bxy * byz - bxz * ay, bxy * bxz - byz * ax
    by_x = (cxx >= cyy) & (cxx >= czz)
    by_y = cyy >= czz
    columns = (cxx, cxy, cxz), (cxy, cyy, cyz), (cxz, cyz, czz)
    along = [np.where(by_x, x, np.where(by_y, y, z)) for x, y, z in columns]
    length = np.sqrt(dots(along, along))
    axes = np.stack([each / np.maximum(length, _DISTINCT) for each in along], axis=1)
    unclear = np.flatnonzero(length <= _DISTINCT)
    axes[unclear] = _by_lapack(tensors[unclear])
    return axes


def eigenvalues(tensors: np.ndarray) -> np.ndarray:
    """Eigenvalues of tensors (m,6) in falling order, (m,3)."""
    mean, spread, angle = _roots(np.ascontiguousarray(tensors.T))
    first, last = (mean + 2 * spread * np.cos(angle + turn) for turn in (0, 2 * np.pi / 3))
    return np.stack([first, 3 * mean - first - last, last], axis=1)


def _roots(columns):
    """Mean, spread and angle, (m,) each, of the eigenvalues ``mean + 2 spread cos(angle + 2 pi k / 3)`` of tensors, six
    (m,): the trigonometric solution of the characteristic cubic (O. K. Smith, Comm. ACM 4(4), 1961)."""
    xx, yy, zz, xy, xz, yz = columns
    mean = (xx + yy + zz) / 3
    dx, dy, dz = xx - mean, yy - mean, zz - mean
    spread = np.sqrt((dx * dx + dy * dy + dz * dz + 2 * (xy * xy + xz * xz + yz * yz)) / 6)
    determinant = dx * (dy * dz - yz * yz) - xy * (xy * dz - yz * xz) + xz * (xy * yz - dy * xz)
    cubed = spread * spread * spread  # NumPy's powers but squares take many times as long
    cosine = determinant / (2 * np.where(cubed > 0, cubed, 1.0))
    return mean, spread, np.arccos(np.clip(cosine, -1, 1)) / 3


def tangent_frames(normals: np.ndarray) -> np.ndarray:
    """Two unit tangents at right angles to each of some normals, (n,3) -> (n,2,3)."""
    helper = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first)], axis=1)


def solve_positive(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions (m,k) of symmetric positive definite systems (m,k,k) with right sides (m,k), by elimination without
    pivoting, which such systems do not need (G. H. Golub and C. F. Van Loan, Matrix Computations, section 4.2)."""
    k = right.shape[1]
    rows = np.ascontiguousarray(np.concatenate([matrices, right[..., None]], axis=2).transpose(1, 2, 0))
    for p in range(k):
        share = rows[p + 1 :, p] / rows[p, p]
        rows[p + 1 :, p + 1 :] -= share[:, None] * rows[p, p + 1 :]
    found = rows[:, k]
    for p in reversed(range(k)):
        found[p] -= (rows[p, p + 1 : k] * found[p + 1 :]).sum(axis=0)
        found[p] /= rows[p, p]
    return found.T


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of vectors stored component by component, (3,m) each."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Inner products of vectors stored component by component, three (...) each."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def quadratic_form(tensor: np.ndarray, v: np.ndarray) -> np.ndarray:
    """v T v, for six and three components (...) each that broadcast."""
    xx, yy, zz, xy, xz, yz = tensor
    x, y, z = v
    return x * (xx * x + 2 * (xy * y + xz * z)) + y * (yy * y + 2 * yz * z) + zz * z * z


def row_dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Inner products along the last axis of arrays (...,k) that broadcast, (...)."""
    return np.einsum("...k,...k->...", a, b)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (...,k) made unit along the last axis; those shorter than 1e-154 come out as hardly more than zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), _SHORTEST)


def unit_columns(a: np.ndarray) -> np.ndarray:
    """The same of vectors stored component by component, (3,m)."""
    return a / np.maximum(lengths(a), _SHORTEST)


def shortened(steps: np.ndarray, longest: float | np.ndarray) -> np.ndarray:
    """Vectors (m,3), those that are longer than `longest`, (m,) or one for all, made as long as that."""
    length = np.maximum(np.linalg.norm(steps, axis=1), longest)
    return steps * (longest / np.maximum(length, np.finfo(float).tiny))[:, None]


def lengths(a: np.ndarray) -> np.ndarray:
    """(m,) of vectors stored component by component, (3,m)."""
    return np.sqrt(np.einsum("im,im->m", a, a))


def outer_sum(terms: Sequence[np.ndarray]) -> np.ndarray:
    """Sums of one term for each of three axes, three (w,...) -> (w,w,w,...)."""
    return terms[0][:, None, None] + terms[1][:, None] + terms[2]


def laplacian_symbol(shape: tuple[int, int, int]) -> np.ndarray:
    """The eigenvalues, of the shape (nx,ny,nz), of the negative Laplacian of a grid's graph without flow through the
    box, whose eigenvectors are those of the cosine transform."""
    return outer_sum([2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in shape])


def symmetric(weight: np.ndarray, low: np.ndarray, high: np.ndarray, n: int) -> csr_matrix:
    """Sparse (n,n) that links pairs, (e,) rows of either end, both ways; weights (e,) of one pair are summed."""
    ends = np.append(low, high), np.append(high, low)
    return coo_matrix((np.append(weight, weight), ends), shape=(n, n)).tocsr()


def links_in_common(links: csr_matrix, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The sum over n items of the products of their links, sparse (n,n), to both of a pair, (m,) rows each, (m,): with
    links of one the number of items that both are linked to."""
    return np.asarray(links[one].multiply(links[other]).sum(axis=1)).reshape(-1)


def conjugate_gradients(
    apply: Callable, right: np.ndarray, start: np.ndarray, precondition: Callable, tolerance: float, steps: Iterable
) -> np.ndarray:
    """The u that a symmetric, positive (semi)definite `apply` takes to `right`, arrays of one shape, from `start` on
    until the residual is at most `tolerance` times as large as `right`, or the `steps` end (G. H. Golub and C. F. Van
    Loan, Matrix Computations, section 11.5). SciPy has the same, but sums by BLAS."""
    u, residual = start.copy(), right - apply(start)
    goal = tolerance * np.sqrt(inner(right, right))
    search = z = precondition(residual)
    energy = inner(residual, z)
    for _ in steps:
        if np.sqrt(inner(residual, residual)) <= goal:
            break
        image = apply(search)
        step = energy / inner(search, image)
        u += step * search
        residual = residual - step * image
        z = precondition(residual)
        before, energy = energy, inner(residual, z)
        search = z + energy / before * search
    return u


def medians(rows: np.ndarray) -> np.ndarray:
    """The median of what is not nan in each row (m,k), (m,) float64, nan where all is. NumPy's takes ten times as long,
    by masked arrays."""
    ascending, count = np.sort(rows, axis=1), (~np.isnan(rows)).sum(axis=1)
    middle = np.stack([np.maximum(count - 1, 0) // 2, count // 2], axis=1).clip(max=rows.shape[1] - 1)
    return np.take_along_axis(ascending, middle, axis=1).mean(axis=1)


def inner(a: np.ndarray, b: np.ndarray) -> float:
    """Sum of the products of two arrays of one shape."""
    return float((a * b).sum())


def _by_lapack(tensors):
    matrices = tensors[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    return np.linalg.eigh(matrices)[1][:, :, 2]
