"""Robust quadrics through the neighbours of samples."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..field.curvature import tangent_frames
from ..linalg import outer, principal_axes, solve_positive
from ..parallel import in_order
from ..progress import Progress

COEFFICIENTS = 6  # 1, x, y, xx, xy, yy
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
    tree = KDTree(points)
    found = Quadrics(np.empty((len(rows), 3)), np.empty(len(rows)), np.empty(len(rows)))

    def fit(part):
        distance, index = tree.query(points[rows[part]], k=neighbours)
        return _fit(points[index] - points[rows[part], None], distance)

    chunks = Progress.of(progress).chunks(len(rows), max(1, _CHUNK // neighbours))
    for part, piece in in_order(fit, chunks):
        found.step[part], found.height[part], found.leverage[part] = piece
    return found


def _fit(offset, distance):
    radius = distance[:, -1:]
    weight = np.exp(-_DECAY * (distance / radius) ** 2)
    for _ in range(_ROUNDS):
        share = weight / weight.sum(axis=1, keepdims=True)
        centred = offset - np.einsum("mk,mki->mi", share, offset)[:, None]
        normal, _ = principal_axes(-np.einsum("mk,mka->ma", share, outer(centred)))
        frame = tangent_frames(normal)
        x, y = np.moveaxis(np.einsum("mki,mai->mka", offset, frame), 2, 0) / radius
        height = np.einsum("mki,mi->mk", offset, normal)
        basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2)
        weighted = basis * share[..., None]
        matrix = weighted.transpose(0, 2, 1) @ basis + _STIFFNESS * np.eye(COEFFICIENTS)
        coefficients = solve_positive(matrix, np.einsum("mka,mk->ma", weighted, height))
        residual = height - np.einsum("mka,ma->mk", basis, coefficients)
        full = 1.0 / weight.sum(axis=1)  # the share of a sample that lies on its quadric
        scale = _CAUCHY * 1.4826 * np.median(np.abs(residual), axis=1, keepdims=True)
        weight = weight / (1.0 + (residual / np.maximum(scale, _EXACT * radius)) ** 2)

    slope = coefficients[:, 1:3] / radius
    upright = normal - np.einsum("ma,mai->mi", slope, frame)
    squared = np.einsum("mi,mi->m", upright, upright)
    step = (coefficients[:, 0] / squared)[:, None] * upright
    leverage = full * solve_positive(matrix, np.broadcast_to(np.eye(COEFFICIENTS)[0], coefficients.shape))[:, 0]
    return step, np.abs(coefficients[:, 0]) / np.sqrt(squared), np.minimum(leverage, 0.95)
