"""Voronoi facets as ordered polygons, for what needs their shape: sampling."""

from dataclasses import dataclass

import numpy as np

from ..linalg import row_dots, tangent_frames
from ..lookup import rows_of, sums_of_each
from .facets import Facets, by_blocks, clip_radius, facets_of, inside_ball, merged

_ARC_STEP = 0.25  # radians; longest chord that stands for a piece of the clip circle
_SAME_ANGLE = 1e-9  # radians


@dataclass(frozen=True)
class FacetPolygons:
    """Convex polygons, one for each clipped facet.

    facets  : Facets, the pairs and the exact areas; the polygons' own fall short of these by less than 1 % of the
              clip disc where arcs became chords, and are equal elsewhere
    corners : (c,3) float64, one polygon after the other, counter-clockwise around the direction from i to j
    first   : (m+1,) int64, polygon k is corners[first[k]:first[k+1]]
    """

    facets: Facets
    corners: np.ndarray
    first: np.ndarray

    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Fans around each polygon's mean corner: (c,3,3) float64, and the polygon of each triangle, (c,) int64."""
        count = np.diff(self.first)
        polygon = np.repeat(np.arange(len(count)), count)
        apex = np.add.reduceat(self.corners, self.first[:-1], axis=0) / count[:, None]
        following = np.arange(1, len(self.corners) + 1)
        following[self.first[1:] - 1] = self.first[:-1]
        return np.stack([apex[polygon], self.corners, self.corners[following]], axis=1), polygon


def facet_polygons(points: np.ndarray, spacing: np.ndarray, seed: int = 0, progress=None) -> FacetPolygons:
    """The polygons whose areas `voronoi_facets` returns; arguments as there."""
    blocks = list(by_blocks(lambda sides: _polygons(sides, points, spacing), points, spacing, seed, progress))
    facets, order = merged([polygons.facets for polygons in blocks])
    count = np.concatenate([np.diff(polygons.first) for polygons in blocks])
    begin, count = (np.cumsum(count) - count)[order], count[order]
    first = np.concatenate([[0], np.cumsum(count)])
    corner = np.repeat(begin - first[:-1], count) + np.arange(first[-1])
    return FacetPolygons(facets, np.concatenate([polygons.corners for polygons in blocks])[corner], first)


def _polygons(sides, points, spacing):
    """The parts of a facet's sides that are inside the ball are sorted by angle around their mean. Where one of them
    leaves the ball, an arc of the clip circle joins it to the next one."""
    facets = facets_of(sides, spacing)
    frame = _Frame.of(points, spacing, facets)
    facet, tail, head, leaves = _parts_inside(sides, facets, frame, len(points))

    count = np.bincount(facet, minlength=len(facets.pairs))
    middle = 0.5 * (tail + head)
    mean = sums_of_each(facet, middle, len(count)) / count[:, None]
    order = np.lexsort((frame.angle(middle - mean[facet], facet), facet))
    facet, tail, head, leaves = facet[order], tail[order], head[order], leaves[order]

    last = np.cumsum(count) - 1
    following = np.arange(1, len(facet) + 1)
    following[last] = last - count + 1
    begin, end = frame.angle(head, facet), frame.angle(tail, facet)[following]
    turn = (end - begin) % (2 * np.pi)
    turn[turn > 2 * np.pi - _SAME_ANGLE] = 0.0
    turn[(following == np.arange(len(facet))) & (turn < _SAME_ANGLE)] = 2 * np.pi

    chords = np.where(leaves, np.maximum(np.ceil(turn / _ARC_STEP), 2), 0).astype(np.int64)
    part = np.repeat(np.arange(len(facet)), 1 + chords)
    position = np.arange(len(part)) - np.repeat(np.cumsum(1 + chords) - chords, 1 + chords)
    angle = begin[part] + turn[part] * position / np.maximum(chords[part], 1)
    corners = np.where((position < 0)[:, None], tail[part], frame.on_circle(angle, facet[part]))
    first = np.searchsorted(facet[part], np.arange(len(count) + 1))
    return FacetPolygons(facets, corners + frame.middle[facet[part]], first)


@dataclass(frozen=True)
class _Frame:
    """Midpoint, in-plane axes (right-handed with the direction from i to j) and clip radius of each facet."""

    middle: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    radius: np.ndarray

    @classmethod
    def of(cls, points, spacing, facets):
        i, j = facets.pairs.T
        axis = points[j] - points[i]
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        e1, e2 = tangent_frames(axis).transpose(1, 0, 2)
        return cls(0.5 * (points[i] + points[j]), e1, e2, clip_radius(spacing, i, j))

    def angle(self, vectors, facet):
        return np.arctan2(row_dots(vectors, self.e2[facet]), row_dots(vectors, self.e1[facet]))

    def on_circle(self, angle, facet):
        unit = np.cos(angle)[:, None] * self.e1[facet] + np.sin(angle)[:, None] * self.e2[facet]
        return self.radius[facet, None] * unit


def _parts_inside(sides, facets, frame, n):
    """Facet, tail, head of each part of a side that is inside the ball, and whether its side goes on beyond its head;
    for a facet that holds the whole disc, one point of its circle."""
    enter, leave = inside_ball(sides)
    keys, key = facets.pairs @ [n, 1], sides.i * n + sides.j
    facet = rows_of(key, keys)
    kept = np.flatnonzero((leave > enter) & (facet >= 0))
    facet, tail, step = facet[kept], sides.tail[kept], sides.head[kept] - sides.tail[kept]
    enter, leave = enter[kept, None], leave[kept, None]
    head, leaves, tail = tail + leave * step, leave[:, 0] < 1, tail + enter * step
    disc = np.setdiff1d(np.arange(len(keys)), facet)
    start = frame.on_circle(np.zeros(len(disc)), disc)
    return (
        np.append(facet, disc),
        np.append(tail, start, axis=0),
        np.append(head, start, axis=0),
        np.append(leaves, np.full(len(disc), True)),
    )


def triangle_areas(triangles: np.ndarray) -> np.ndarray:
    """(t,3,3) -> (t,)."""
    a, b, c = triangles.transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
