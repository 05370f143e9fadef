"""Robust quadrics through the neighbours of samples."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..field.curvature import tangent_frames
from ..linalg import COMPONENTS, principal_axes, solve_positive
from ..parallel import in_order
from ..progress import Progress

COEFFICIENTS = 6  # of 1, x, y, xx, xy, yy
_DECAY = 3.0  # of the Gaussian weight at the farthest neighbour
_ROUNDS = 2
_CAUCHY = 2.0  # residuals above this many robust standard deviations lose weight
_STIFFNESS = 1e-6
_EXACT = 1e-9  # residuals below this share of the radius are rounding
_CHUNK = 30_000  # neighbours


@dataclass(frozen=True)
class Quadrics:
    """Where samples stand beside the quadric through their neighbours.

    step     : (m,3) float64, from the sample onto the quadric
    height   : (m,) float64, length of that step
    leverage : (m,) float64 in [0,1), share of its own position in the quadric's height at the sample
    """

    step: np.ndarray
    height: np.ndarray
    leverage: np.ndarray

    def left_out(self) -> np.ndarray:
        """(m,) float64: distance to the quadric that the sample itself had no part in."""
        return self.height / (1.0 - self.leverage)


def fit_quadrics(points, rows, neighbours: int, progress=None) -> Quadrics:
    """Quadric height fields over the tangent planes of samples `rows`, each through its `neighbours` nearest.

    points : (n,3) float64     rows : (m,) int

    The plane is the weighted principal plane; weights fall with the squared distance and, in a second round, with the
    residual (Cauchy), so that a few strays do not bend the fit.
    """
    tree, columns = KDTree(points), points.T.copy()
    found = Quadrics(np.empty((len(rows), 3)), np.empty(len(rows)), np.empty(len(rows)))

    def fit(part):
        distance, index = tree.query(points[rows[part]], k=neighbours)
        return _fit([x.take(index) - x.take(rows[part])[:, None] for x in columns], distance)

    chunks = Progress.of(progress).chunks(len(rows), max(1, _CHUNK // neighbours))
    for part, piece in in_order(fit, chunks):
        found.step[part], found.height[part], found.leverage[part] = piece
    return found


def _fit(offset, distance):
    """Step, height and leverage of quadrics through neighbours with offsets, three (m,k), from the sample."""
    radius = distance[:, -1:]
    weight = np.exp(-_DECAY * (distance / radius) ** 2)
    for _ in range(_ROUNDS):
        full = 1.0 / np.einsum("mk->m", weight)  # the share of a sample that lies on its quadric
        share = weight * full[:, None]
        normal = _least_spread(offset, share)
        frame = tangent_frames(normal)
        axes = frame[:, 0] / radius, frame[:, 1] / radius, normal
        x, y, height = (sum(part * axis[:, a, None] for a, part in enumerate(offset)) for axis in axes)
        basis = np.ones_like(x), x, y, x * x, x * y, y * y
        matrix, right = _normal_equations(basis, share, height)
        coefficients = solve_positive(matrix, right)
        residual = height - sum(coefficients[:, a, None] * term for a, term in enumerate(basis))
        scale = _CAUCHY * 1.4826 * np.median(np.abs(residual), axis=1, keepdims=True)
        weight = weight / (1.0 + (residual / np.maximum(scale, _EXACT * radius)) ** 2)

    slope = coefficients[:, 1:3] / radius
    upright = normal - np.einsum("ma,mai->mi", slope, frame)
    squared = np.einsum("mi,mi->m", upright, upright)
    step = (coefficients[:, 0] / squared)[:, None] * upright
    leverage = full * solve_positive(matrix, np.broadcast_to(np.eye(COEFFICIENTS)[0], coefficients.shape))[:, 0]
    return step, np.abs(coefficients[:, 0]) / np.sqrt(squared), np.minimum(leverage, 0.95)


def _least_spread(offset, share):
    """Normals (m,3) of the weighted principal planes of points three (m,k) with weights (m,k) that sum to 1."""
    weighted = [share * part for part in offset]
    mean = [np.einsum("mk->m", part) for part in weighted]
    spread = [np.einsum("mk,mk->m", weighted[a], offset[b]) - mean[a] * mean[b] for a, b in COMPONENTS]
    return principal_axes(-np.stack(spread, axis=1))[0]


def _normal_equations(basis, share, height):
    """Matrices (m,c,c) and right sides (m,c) of weighted fits of c terms (m,k) to heights (m,k)."""
    m, c = len(height), len(basis)
    matrix, right = np.empty((m, c, c)), np.empty((m, c))
    for a, term in enumerate(basis):
        weighted = share * term
        right[:, a] = np.einsum("mk,mk->m", weighted, height)
        for b in range(a, c):
            matrix[:, a, b] = matrix[:, b, a] = np.einsum("mk,mk->m", weighted, basis[b])
    return matrix + _STIFFNESS * np.eye(c), right
