"""Voronoi facets between samples: which samples share a bisector, and how much of it.

A facet (i,j) is dual to the Delaunay edge (i,j). Its border runs through the circumcentres of the tetrahedra around
that edge, one segment for each Delaunay face at it, so its area is a sum of signed triangles over the faces and needs
no ordered polygon.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

CLIP_RADIUS = 4.0  # local spacings
_JITTER = 1e-6  # local spacings
_CORNER_DISTANCE = 5.0  # half box sides

# Faces of a positively oriented tetrahedron, counter-clockwise seen from outside; face k is opposite vertex k.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True)
class Facets:
    """Clipped Voronoi facets between samples.

    pairs : (m,2) int64, i < j, every pair once
    area  : (m,) float64, area inside a ball of CLIP_RADIUS local spacings around the pair's midpoint, squared units of
            the samples
    """

    pairs: np.ndarray
    area: np.ndarray


def voronoi_facets(points: np.ndarray, spacing: np.ndarray, seed: int = 0) -> Facets:
    """The facets of the samples' Voronoi diagram (section 3.2 of the paper), clipped.

    points  : (n,3) float64
    spacing : (n,) float64, local spacing of each sample, units of `points`

    Departures from the paper: sites are jittered by 1e-6 spacings, because Qhull is quadratic on cospherical and
    coplanar input; and facets are clipped, because the few that run out to the box would outweigh all others.
    """
    sites = _sites(points, spacing, seed)
    delaunay = Delaunay(sites)
    centre, orientation = _circumcentres(sites, delaunay.simplices)

    tetrahedron, opposite = np.nonzero(delaunay.neighbors > np.arange(len(delaunay.simplices))[:, None])
    beyond = delaunay.neighbors[tetrahedron, opposite]
    faces = np.take_along_axis(delaunay.simplices[tetrahedron], _FACES[opposite], axis=1)

    n = len(points)
    keys, areas = [], []
    for tail, head in ((0, 1), (1, 2), (2, 0)):
        a, b = faces[:, tail], faces[:, head]
        real = np.flatnonzero((a < n) & (b < n))
        a, b = a[real].astype(np.int64), b[real].astype(np.int64)
        near, far = tetrahedron[real], beyond[real]
        axis = sites[b] - sites[a]
        middle = 0.5 * (sites[a] + sites[b])
        radius = 0.5 * CLIP_RADIUS * (spacing[a] + spacing[b])
        swept = np.cross(_clipped(centre[near] - middle, radius), _clipped(centre[far] - middle, radius))
        signed = np.einsum("ij,ij->i", swept, axis) / np.linalg.norm(axis, axis=1)
        keys.append(np.minimum(a, b) * n + np.maximum(a, b))
        areas.append(0.5 * orientation[near] * signed)

    key, facet = np.unique(np.concatenate(keys), return_inverse=True)
    area = np.bincount(facet, weights=np.concatenate(areas), minlength=len(key))
    return Facets(np.stack(np.divmod(key, n), axis=1), np.maximum(area, 0.0))


def _sites(points, spacing, seed):
    jitter = np.random.default_rng(seed).uniform(-1, 1, points.shape) * (_JITTER * spacing)[:, None]
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    reach = _CORNER_DISTANCE * 0.5 * np.ptp(points, axis=0).max()
    corners = middle + reach * (2 * np.indices((2, 2, 2)).reshape(3, 8).T - 1)
    return np.concatenate([points + jitter, corners])


def _circumcentres(sites, simplices):
    """(t,3) circumcentres and (t,) orientations (+1 or -1) of tetrahedra."""
    origin = sites[simplices[:, 0]]
    a, b, c = (sites[simplices[:, k]] - origin for k in (1, 2, 3))
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = np.einsum("ij,ij->i", a, bc)
    lengths = [np.einsum("ij,ij->i", e, e)[:, None] for e in (a, b, c)]
    numerator = lengths[0] * bc + lengths[1] * ca + lengths[2] * ab
    orientation = np.where(volume < 0, -1.0, 1.0)
    flat = np.finfo(np.float64).tiny
    safe = np.where(np.abs(volume) < flat, orientation * flat, volume)
    with np.errstate(over="ignore"):
        offset = np.clip(numerator / (2 * safe[:, None]), -1e6, 1e6)
    return origin + offset, orientation


def _clipped(vectors, radius):
    length = np.linalg.norm(vectors, axis=1)
    return vectors * np.minimum(1.0, radius / np.maximum(length, np.finfo(np.float64).tiny))[:, None]
