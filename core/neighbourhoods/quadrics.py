"""Robust quadrics through the neighbours of samples.

Offsets are taken in double precision and worked on in radii, in single precision, component by component.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from ..linalg import COMPONENTS, dots, principal_axes, row_dots, solve_positive, tangent_frames
from ..parallel import even_chunks, in_order
from ..progress import Progress
from ..records import joined
from .clusters import Clusters

GAUSS = 1.4826  # standard deviations in a median absolute error
STIFFNESS = 1e-6  # of coefficients, in radii
EXACT = np.float32(1e-6)  # residuals below this share of the radius are rounding

_COEFFICIENTS = 6  # of 1, x, y, xx, xy, yy
_DECAY = 3.0  # of the Gaussian weight at the farthest neighbour
_CAUCHY = 2.0  # residuals above this many robust standard deviations lose weight
_SINGLY = 200  # neighbours, above which the means of clusters stand for them
_MEANS = 128  # of them then, at most, where all clusters are full
_CHUNK, _QUERIED = 60_000, 300_000  # neighbours, fitted and asked for at a time

# Where the moments 1, x, y, xx, xy, yy, xxx, xxy, xyy, yyy, xxxx, xxxy, xxyy, xyyy, yyyy stand in the normal equations.
_MOMENTS = np.array(
    [
        [0, 1, 2, 3, 4, 5],
        [1, 3, 4, 6, 7, 8],
        [2, 4, 5, 7, 8, 9],
        [3, 6, 7, 10, 11, 12],
        [4, 7, 8, 11, 12, 13],
        [5, 8, 9, 12, 13, 14],
    ]
)


@dataclass(frozen=True)
class Quadrics:
    """Where samples stand beside the quadric through their neighbours.

    step     : (m,3) float64, from the sample onto the quadric
    height   : (m,) float64, length of that step
    normal   : (m,3) float64, unit normal of the quadric over the sample
    leverage : (m,) float64 in [0,1), share of its own position in the quadric's height at the sample
    radius   : (m,) float64, distance to the farthest of the neighbours
    spread   : (m,) float64, robust standard deviation of the neighbours off it, before any of them loses weight
    """

    step: np.ndarray
    height: np.ndarray
    normal: np.ndarray
    leverage: np.ndarray
    radius: np.ndarray
    spread: np.ndarray

    def left_out(self) -> np.ndarray:
        """(m,) float64: distance to the quadric that the sample itself had no part in."""
        return self.height / (1.0 - self.leverage)


@dataclass(frozen=True)
class Residuals:
    """How the neighbours of samples stand off the quadric through them, those near the sample counting for more.

    kurtosis : (m,) float64, 1 where all are as far off it, on two sheets, 3 for Gaussian noise; nan where none is off
    level    : (m,) float64, how far they are, root mean square
    normal   : (m,3) float64, unit normal of their plane
    """

    kurtosis: np.ndarray
    level: np.ndarray
    normal: np.ndarray


def fit_quadrics(points, rows, neighbours: int, progress=None, clusters: Clusters | None = None) -> Quadrics:
    """Quadric height fields over the tangent planes of samples `rows`, each through its `neighbours` nearest.

    points : (n,3) float64     rows : (m,) int     clusters : of the points, where they are at hand

    The plane is the weighted principal plane; weights of the quadric fall with the squared distance and, in a second
    round, with the residual (Cauchy), so that a few strays do not bend the fit. More than 200 neighbours are taken as
    the means of clusters of them, which in a neighbourhood so wide are small.
    """
    if neighbours <= _SINGLY:
        return nested_quadrics(points, rows, (neighbours,), progress)[0]
    means = (clusters or Clusters(points)).means(2 ** int(np.ceil(np.log2(neighbours / _MEANS))))
    share = len(means) / len(points)
    (found,) = _through(means, points[rows], (round(share * neighbours),), _quadrics, progress)
    return replace(found, leverage=share * found.leverage)


def quadrics_at(points, places, neighbours: int, progress=None) -> Quadrics:
    """The same at places (m,3) that are none of the points. These have no part in their quadrics, so distances to them
    are the heights; :meth:`Quadrics.left_out` is for samples alone."""
    (found,) = _through(points, places, (neighbours,), _quadrics, progress)
    return found


def nested_quadrics(points, rows, sizes, progress=None) -> list[Quadrics]:
    """The same through each of several numbers of neighbours, `sizes`, in rising order, all of them singly."""
    return _through(points, points[rows], sizes, _quadrics, progress)


def nested_residuals(points, rows, sizes, progress=None) -> list[Residuals]:
    """What the neighbours of samples `rows` (m,) are off those quadrics, before any of them loses weight."""
    return _through(points, points[rows], sizes, _residuals, progress)


def _through(points, places, sizes, way, progress):
    """What a `way` of fitting finds at places (m,3) through each of several numbers of the nearest points (n,3)."""
    tree, columns, most = KDTree(points), points.T.copy(), int(sizes[-1])

    def fit(part):
        distance, index = tree.query(places[part], k=most)
        offset = [x.take(index) - x_here[:, None] for x, x_here in zip(columns, places[part].T, strict=True)]

        def pieces(k):
            for first in range(0, len(index), step := max(1, _CHUNK // k)):
                some = slice(first, first + step)
                radius = np.maximum(distance[some, k - 1], np.finfo(float).tiny)
                in_radii = (each[some, :k] / radius[:, None] for each in (*offset, distance))
                *steps, away = (each.astype(np.float32) for each in in_radii)
                yield way(steps, away, radius)

        return [joined(list(pieces(k))) for k in sizes]

    chunks = even_chunks(len(places), max(1, _QUERIED // most), Progress.of(progress))
    parts = [found for _, found in in_order(fit, chunks)]
    return [joined(found) for found in zip(*parts, strict=True)]


def _quadrics(offset, distance, radius):
    """Quadrics through neighbours with offsets, three (m,k), from the sample and distances (m,k), in radii (m,)."""
    normal, frame, basis, weight, height = in_frames(offset, distance)
    residual = off_fit(weighted_fit(basis, weight, height)[0], basis, height)
    spread = np.float32(GAUSS) * np.median(np.abs(residual), axis=1)
    weight = weight / (1 + (residual / np.maximum(np.float32(_CAUCHY) * spread[:, None], EXACT)) ** 2)
    coefficients, matrix, full = weighted_fit(basis, weight, height)
    step, height, normal = onto_quadrics(coefficients, normal, frame, radius)
    leverage = full * solve_positive(matrix, np.broadcast_to(np.eye(_COEFFICIENTS)[0], coefficients.shape))[:, 0]
    return Quadrics(step, height, normal, np.minimum(leverage, 0.95), radius, radius * spread)


def _residuals(offset, distance, radius):
    """Residuals of such neighbours."""
    normal, _, basis, weight, height = in_frames(offset, distance)
    squared = off_fit(weighted_fit(basis, weight, height)[0], basis, height) ** 2
    weight /= np.einsum("mk->m", weight)[:, None]
    second, fourth = (row_dots(weight, term).astype(float) for term in (squared, squared * squared))
    with np.errstate(invalid="ignore"):
        return Residuals(fourth / second**2, radius * np.sqrt(second), normal)


def in_frames(offset, distance):
    """Of such neighbours: normals (m,3) of the weighted principal planes and frames (m,2,3) in them; the terms x, y,
    xx, xy, yy, five (m,k); weights, and heights over the planes, (m,k)."""
    weight = np.exp(np.float32(-_DECAY) * distance**2)
    normal = _least_spread(offset, weight / np.einsum("mk->m", weight)[:, None])
    frame, basis, height = over_planes(offset, normal)
    return normal, frame, basis, weight, height


def over_planes(offset, normal):
    """Frames (m,2,3) in planes with normals (m,3) through samples whose neighbours have offsets, three (m,k); the terms
    x, y, xx, xy, yy of these, five (m,k), and their heights (m,k)."""
    frame = tangent_frames(normal)
    axes = (axis.T[:, :, None].astype(np.float32) for axis in (frame[:, 0], frame[:, 1], normal))
    x, y, height = (dots(offset, axis) for axis in axes)
    return frame, (x, y, x * x, x * y, y * y), height


def onto_quadrics(coefficients, normal, frame, radius):
    """Steps (m,3) from samples onto quadrics of `coefficients` (m,6) over planes with a `normal` (m,3) and a `frame`
    (m,2,3), in radii (m,); their lengths (m,), and the unit normals (m,3) there."""
    upright = normal - np.einsum("ma,mai->mi", coefficients[:, 1:3], frame)
    squared = row_dots(upright, upright)
    step = (radius * coefficients[:, 0] / squared)[:, None] * upright
    steep = np.sqrt(squared)
    return step, radius * np.abs(coefficients[:, 0]) / steep, upright / steep[:, None]


def off_fit(coefficients, basis, height):
    """How far heights (m,k) are off those that `coefficients` (m,6) of the terms 1 and `basis` give."""
    coefficients = coefficients.astype(np.float32)
    residual = height - coefficients[:, :1]
    for a, term in enumerate(basis, start=1):
        residual -= coefficients[:, a, None] * term
    return residual


def _least_spread(offset, share):
    """Normals (m,3) of the weighted principal planes of points three (m,k) with weights (m,k) that sum to 1."""
    weighted = [share * part for part in offset]
    mean = [np.einsum("mk->m", part) for part in weighted]
    spread = [row_dots(weighted[a], offset[b]) - mean[a] * mean[b] for a, b in COMPONENTS]
    return principal_axes(-np.stack(spread, axis=1))


def weighted_fit(basis, weight, height, stiffness=STIFFNESS):
    """Coefficients (m,6) of the terms 1 and `basis`, five (m,k), that fit heights (m,k) best; the matrices (m,6,6) of
    the normal equations, and (m,) what a sample at the origin counts in them. `stiffness`, one or (6,), holds the
    coefficients back."""
    x, y, xx, xy, yy = basis
    full = 1.0 / np.einsum("mk->m", weight)
    share = weight * full[:, None]
    weighted = [share, *(share * term for term in basis)]
    by_xx, by_xy, by_yy = weighted[3:]
    moments = [np.einsum("mk->m", term) for term in weighted]
    moments += [row_dots(by_xx, x), row_dots(by_xx, y), row_dots(by_yy, x), row_dots(by_yy, y)]
    moments += [row_dots(by_xx, xx), row_dots(by_xx, xy), row_dots(by_xx, yy), row_dots(by_xy, yy), row_dots(by_yy, yy)]
    matrix = np.stack(moments, axis=1)[:, _MOMENTS] + stiffness * np.eye(_COEFFICIENTS)
    return solve_positive(matrix, np.stack([row_dots(each, height) for each in weighted], axis=1)), matrix, full
