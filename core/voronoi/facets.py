"""Voronoi facets between samples: which samples share a bisector, and how much of it.

A facet (i,j) is dual to the Delaunay edge (i,j). Its border runs through the circumcentres of the tetrahedra around
that edge, one side for each Delaunay face at it, so its area is a sum over the faces and needs no ordered polygon.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import Delaunay

CLIP_RADIUS = 2.5  # local spacings
_NEGLIGIBLE = 1e-9  # squared clip radii
_JITTER = 1e-6  # local spacings
_CORNER_DISTANCE = 5.0  # half box sides

# Faces of a positively oriented tetrahedron, counter-clockwise seen from outside; face k is opposite vertex k.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True)
class Facets:
    """Clipped Voronoi facets between samples.

    pairs : (m,2) int64, i < j, every pair once, sorted
    area  : (m,) float64, area inside a ball of CLIP_RADIUS local spacings around the pair's midpoint, squared units of
            the samples; pairs with nothing inside the ball are left out
    """

    pairs: np.ndarray
    area: np.ndarray


@dataclass(frozen=True)
class FacetSides:
    """Sides of unclipped facets, each facet's counter-clockwise seen against the direction from i to j.

    i, j       : (s,) int64, the pair whose facet this is a side of, i < j
    tail, head : (s,3) float64, ends of the side relative to the pair's midpoint
    axis       : (s,3) float64, unit direction from i to j
    radius     : (s,) float64, radius of the ball to clip to
    """

    i: np.ndarray
    j: np.ndarray
    tail: np.ndarray
    head: np.ndarray
    axis: np.ndarray
    radius: np.ndarray


def voronoi_facets(points: np.ndarray, spacing: np.ndarray, seed: int = 0) -> Facets:
    """The facets of the samples' Voronoi diagram (section 3.2 of the paper), clipped.

    points  : (n,3) float64
    spacing : (n,) float64, local spacing of each sample, units of `points`

    Departures from the paper: sites are jittered by 1e-6 spacings, because Qhull is quadratic on cospherical and
    coplanar input; and facets are clipped, because far from the surface they say nothing about it, and the few that
    run out to the box would outweigh all others.
    """
    return collect_facets(facet_sides(points, spacing, seed), spacing)


def collect_facets(portions: Iterable[FacetSides], spacing: np.ndarray) -> Facets:
    """The facets that have these sides."""
    n = len(spacing)
    areas = sparse.csr_matrix((n, n))
    for sides in portions:
        areas += sparse.csr_matrix((_swept_area(sides), (sides.i, sides.j)), shape=(n, n))
    areas = areas.tocoo()
    kept = areas.data > _NEGLIGIBLE * clip_radius(spacing, areas.row, areas.col) ** 2
    return Facets(np.stack([areas.row[kept], areas.col[kept]], axis=1).astype(np.int64), areas.data[kept])


def facet_sides(points: np.ndarray, spacing: np.ndarray, seed: int = 0) -> Iterator[FacetSides]:
    """Every side of every facet between two of the samples, in three portions; arguments as in `voronoi_facets`."""
    sites = _sites(points, spacing, seed)
    delaunay = Delaunay(sites)
    centre, positive = _circumcentres(sites, delaunay.simplices)
    tetrahedron, opposite = np.nonzero(delaunay.neighbors > np.arange(len(delaunay.simplices))[:, None])
    beyond = delaunay.neighbors[tetrahedron, opposite]
    faces = np.take_along_axis(delaunay.simplices[tetrahedron], _FACES[opposite], axis=1)
    positive = positive[tetrahedron]

    for first, second in ((0, 1), (1, 2), (2, 0)):
        a, b = faces[:, first], faces[:, second]
        real = np.flatnonzero((a < len(points)) & (b < len(points)))
        a, b = a[real].astype(np.int64), b[real].astype(np.int64)
        near, far = tetrahedron[real], beyond[real]
        outward = (a < b) == positive[real]
        i, j = np.minimum(a, b), np.maximum(a, b)
        step, middle = sites[j] - sites[i], 0.5 * (sites[i] + sites[j])
        yield FacetSides(
            i,
            j,
            tail=centre[np.where(outward, near, far)] - middle,
            head=centre[np.where(outward, far, near)] - middle,
            axis=step / np.sqrt(dot(step, step))[:, None],
            radius=clip_radius(spacing, i, j),
        )


def clip_radius(spacing, i, j):
    """Radius of the ball that the facet of samples i and j is clipped to, in the units of `spacing`."""
    return 0.5 * CLIP_RADIUS * (spacing[i] + spacing[j])


def inside_ball(sides: FacetSides) -> tuple[np.ndarray, np.ndarray]:
    """Where each side enters and leaves the ball, both (s,) in [0,1] from tail to head; equal where it stays out."""
    step = sides.head - sides.tail
    a, b = dot(step, step), dot(step, sides.tail)
    discriminant = b * b - a * (dot(sides.tail, sides.tail) - sides.radius**2)
    root, a = np.sqrt(np.maximum(discriminant, 0.0)), np.maximum(a, np.finfo(np.float64).tiny)
    hit = discriminant > 0
    return np.where(hit, np.clip((-b - root) / a, 0, 1), 0.0), np.where(hit, np.clip((-b + root) / a, 0, 1), 0.0)


def dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def _swept_area(sides):
    """Signed area, inside the ball, of the triangle between the midpoint and each side: a triangle over the part of
    the side that is inside, a circular sector over each part that is not."""
    enter, leave = inside_ball(sides)
    tt, th, hh = dot(sides.tail, sides.tail), dot(sides.tail, sides.head), dot(sides.head, sides.head)
    turn = dot(np.cross(sides.tail, sides.head), sides.axis)
    before = np.arctan2(enter * turn, (1 - enter) * tt + enter * th)
    after = np.arctan2((1 - leave) * turn, (1 - leave) * th + leave * hh)
    return 0.5 * (sides.radius**2 * (before + after) + (leave - enter) * turn)


def _sites(points, spacing, seed):
    jitter = np.random.default_rng(seed).uniform(-1, 1, points.shape) * (_JITTER * spacing)[:, None]
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    reach = _CORNER_DISTANCE * 0.5 * np.ptp(points, axis=0).max()
    corners = middle + reach * (2 * np.indices((2, 2, 2)).reshape(3, 8).T - 1)
    return np.concatenate([points + jitter, corners])


def _circumcentres(sites, simplices):
    """(t,3) circumcentres of tetrahedra, and (t,) bool, whether each is positively oriented."""
    origin = sites[simplices[:, 0]]
    a, b, c = (sites[simplices[:, k]] - origin for k in (1, 2, 3))
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = dot(a, bc)
    numerator = dot(a, a)[:, None] * bc + dot(b, b)[:, None] * ca + dot(c, c)[:, None] * ab
    positive = volume >= 0
    flat = np.finfo(np.float64).tiny
    safe = np.where(np.abs(volume) < flat, np.where(positive, flat, -flat), volume)
    with np.errstate(over="ignore"):
        offset = np.clip(numerator / (2 * safe[:, None]), -1e6, 1e6)
    return origin + offset, positive
