"""Ways to take points from a surface, and to spoil them. All return points and their normals, (n,3) each."""

import numpy as np
from scipy.spatial import KDTree

from core.voronoi.bisectors import greedy_choice

from .shapes.surface import Surface, sample

_CANDIDATES = 10  # per point of a blue-noise sampling
_COVERED = 0.547  # share of a plane that discs thrown at random without overlap end up covering
_TRIES, _SURPLUS = 6, 1.005  # attempts at the radius; points to aim for, per point asked for


def uniform(surface: Surface, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Random points, uniform by area."""
    return sample(surface, count, rng)


def blue_noise(surface: Surface, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Random points none of which are closer than a radius, found so that about `count` fit (dart throwing)."""
    points, normals = sample(surface, _CANDIDATES * count, rng)
    radius = np.sqrt(4 * _COVERED / np.pi * surface.mesh.face_areas().sum() / count)
    for _ in range(_TRIES):
        kept = _apart(points, radius)
        if count <= len(kept) < _SURPLUS**2 * count:
            break
        radius *= np.sqrt(len(kept) / (_SURPLUS * count))
    return points[kept[:count]], normals[kept[:count]]


def graded(surface: Surface, count: int, rng: np.random.Generator, contrast: float = 30.0):
    """Random points whose density falls `contrast`-fold along the x axis."""
    points, normals = sample(surface, 8 * count, rng)
    along = (points[:, 0] - points[:, 0].min()) / np.ptp(points[:, 0])
    chance = contrast**-along
    kept = rng.choice(len(points), count, replace=False, p=chance / chance.sum())
    return points[kept], normals[kept]


def pierced(surface: Surface, count: int, rng: np.random.Generator, holes: int = 12, width: float = 6.0):
    """Blue noise with round holes, `width` spacings of the samples wide."""
    points, normals = blue_noise(surface, count, rng)
    tree = KDTree(points)
    spacing = tree.query(points, 7)[0][:, 1:].mean()
    gone = tree.query_ball_point(points[rng.choice(len(points), holes, replace=False)], width * spacing / 2)
    kept = np.setdiff1d(np.arange(len(points)), np.concatenate(gone))
    return points[kept], normals[kept]


def wires(surface: Surface, count: int, rng: np.random.Generator, planes: int = 9, thickness: float = 0.004, axes=3):
    """Only points near evenly spaced planes across the first `axes` of x, y and z: a cage of contour lines."""
    points, normals = sample(surface, 40 * count, rng)
    places = (np.arange(planes) + 0.5) / planes * 0.8 - 0.4
    near = np.flatnonzero((np.abs(points[:, :axes, None] - places) < thickness / 2).any(axis=(1, 2)))
    kept = near[:count]
    return points[kept], normals[kept]


def contours(surface: Surface, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Only points on 32 evenly spaced slices across x, as of a scanner that moves along it."""
    return wires(surface, count, rng, planes=32, thickness=0.001, axes=1)


def _apart(points, radius):
    """Rows kept when points come one by one and those closer than `radius` to a kept one are turned away."""
    first, second = KDTree(points).query_pairs(radius, output_type="ndarray").T  # first < second
    return greedy_choice(len(points), first, second)
