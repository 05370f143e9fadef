"""Voronoi facets between samples: which samples share a bisector, and how much of it.

A facet (i,j) is dual to the Delaunay edge (i,j). Its border runs through the circumcentres of the tetrahedra around
that edge, one side for each Delaunay face at it, so its area is a sum over the faces and needs no ordered polygon.

The diagram is made block by block, which gives the facets of the whole. Say that sample i has the larger local spacing
s of a pair (i,j) at distance L <= REACH s. What is kept of its facet lies within r <= CLIP_RADIUS s of the pair's
midpoint, and a point x of the bisector at distance r from there is at sqrt(r^2 + L^2 / 4) from both. It belongs to the
facet unless a third sample is closer to x, hence closer to i than twice that. So all samples within

    2 s sqrt(CLIP_RADIUS^2 + REACH^2 / 4)

of i tell what the clipped facet is, and a block needs, besides its own samples, those in such balls around them.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.spatial import Delaunay, KDTree, QhullError

from ..errors import InputError
from ..linalg import row_dots
from ..parallel import in_order
from ..progress import Progress
from .blocks import overlapping_blocks

CLIP_RADIUS = 2.5  # local spacings
REACH = 4.0  # local spacings, the larger of a pair's

_HEEDED = 2 * math.hypot(CLIP_RADIUS, REACH / 2)  # local spacings, radius of the balls
_NEGLIGIBLE = 1e-9  # squared clip radii
_JITTER = 1e-6  # local spacings
_FINER, _STIRRED = 0.02, 1e-3  # times the spacing of a block's own; local spacings, jitter of others that much finer
_FARTHEST = 1e6  # half boxes, to which circumcentres of flat tetrahedra are brought in
_CORNER_DISTANCE = 5.0  # half boxes; from 3 on the tetrahedron holds the box

_TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])

T = TypeVar("T")

# Faces of a positively oriented tetrahedron, counter-clockwise seen from outside; face k is opposite vertex k.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True)
class Facets:
    """Clipped Voronoi facets between samples.

    pairs : (m,2) int64, i < j, every pair once, sorted
    area  : (m,) float64, area inside a ball of CLIP_RADIUS local spacings around the pair's midpoint, squared units of
            the samples; pairs with nothing inside the ball, or farther apart than REACH, are left out
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


def voronoi_facets(points: np.ndarray, spacing: np.ndarray, seed: int = 0, progress=None) -> Facets:
    """The facets of the samples' Voronoi diagram (section 3.2 of the paper), clipped.

    points  : (n,3) float64
    spacing : (n,) float64, local spacing of each sample, units of `points`

    Departures from the paper: sites are jittered by 1e-6 spacings, because Qhull is quadratic on cospherical and
    coplanar input. Where a block of sparse samples heeds far finer ones, it heeds one of them in each cell as fine,
    jittered by 1e-3 spacings, since less is lost in rounding beside the block's extent. Facets are clipped, because far
    from the surface they say nothing about it, and the few that run out to the box would outweigh all others. And
    facets between samples far apart, on either side of a hollow, are left out, which makes the diagram local and
    changes mean |n.n_true| by less than 1e-4 (noise: 2e-4).

    Raises :class:`InputError` where distances are too different in size for Qhull.
    """
    return merged(list(by_blocks(lambda sides: facets_of(sides, spacing), points, spacing, seed, progress)))[0]


def merged(blocks: list[Facets]) -> tuple[Facets, np.ndarray]:
    """The facets of all blocks, and where each of these was among those of the blocks one after another."""
    pairs = np.concatenate([facets.pairs for facets in blocks])
    order = np.argsort(pairs[:, 0] * (pairs.max(initial=0) + 1) + pairs[:, 1])
    return Facets(pairs[order], np.concatenate([facets.area for facets in blocks])[order]), order


def facets_of(sides: FacetSides, spacing: np.ndarray) -> Facets:
    """The facets that have these sides, in the order of their pairs."""
    n = len(spacing)
    keys, facet = np.unique(sides.i * n + sides.j, return_inverse=True)
    i, j = np.divmod(keys, n)
    area = np.bincount(facet, weights=_swept_area(sides), minlength=len(keys))
    kept = area > _NEGLIGIBLE * clip_radius(spacing, i, j) ** 2
    return Facets(np.stack([i[kept], j[kept]], axis=1), area[kept])


def by_blocks(
    make: Callable[[FacetSides], T], points: np.ndarray, spacing: np.ndarray, seed: int = 0, progress=None
) -> Iterator[T]:
    """What `make` makes of every side of the facets of a block, block by block, from the one with most points to the
    one with fewest; arguments as in `voronoi_facets`.

    No facet is in two blocks. Qhull lets other threads run, so blocks are made by all cores; what comes back does not
    depend on their number.
    """
    progress = Progress.of(progress)
    jitter = np.random.default_rng(seed).uniform(-1, 1, points.shape) * (_JITTER * spacing)[:, None]
    sites, radius = points + jitter, _HEEDED * spacing
    stir = jitter * (_STIRRED / _JITTER)
    blocks, done = overlapping_blocks(sites, radius, progress.part(0.0, 0.1)), 0
    blocks.sort(key=lambda block: -len(block.members))  # the largest would be worked on alone if it came last
    for block, made in in_order(lambda block: make(_sides(sites, stir, spacing, radius, block)), blocks):
        yield made
        done += len(block.own)
        progress(0.1 + 0.9 * done / len(points))


def _sides(sites, stir, spacing, radius, block):
    """Sides of the facets whose pair's sample with the larger spacing, or the first of equals, is the block's own."""
    members, own, finer = _heeded(sites, spacing, block)
    count, spacing = len(members), spacing[members]
    beyond = radius[block.own].max() if count < len(sites) else 0.0  # the outermost of all have nothing to heed there
    sites = sites[members] + np.where(finer[:, None], stir[members], 0.0)
    sites -= sites.mean(axis=0)  # a frame of their own, which takes no digits from distances
    sites = np.concatenate([sites, _corners(sites, beyond)])
    delaunay = _tetrahedra(sites)

    touching = np.append(own, np.zeros(len(_TETRAHEDRON), bool))[delaunay.simplices].any(axis=1)
    kept = np.flatnonzero(touching)
    position = np.full(len(touching) + 1, -1)  # the last is the neighbour -1 of a face without one
    position[kept] = np.arange(len(kept))
    simplices, neighbors = delaunay.simplices[kept], position[delaunay.neighbors[kept]]
    centre, positive = _circumcentres(sites, simplices)
    tetrahedron, opposite = np.nonzero(neighbors > np.arange(len(kept))[:, None])
    beyond = neighbors[tetrahedron, opposite]
    faces = np.take_along_axis(simplices[tetrahedron], _FACES[opposite], axis=1).astype(np.int64)

    a, b = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    near, far = np.tile(tetrahedron, 3), np.tile(beyond, 3)
    real = np.flatnonzero((a < count) & (b < count))
    a, b, near, far = a[real], b[real], near[real], far[real]
    i, j = np.minimum(a, b), np.maximum(a, b)
    owner = np.where(spacing[j] > spacing[i], j, i)
    step = sites[j] - sites[i]
    length = np.sqrt(row_dots(step, step))
    kept = np.flatnonzero(own[owner] & (length <= REACH * spacing[owner]))
    i, j, step, length, near, far = i[kept], j[kept], step[kept], length[kept], near[kept], far[kept]
    outward = (a[kept] == i) == positive[near]
    middle = 0.5 * (sites[i] + sites[j])
    return FacetSides(
        members[i],
        members[j],
        tail=centre[np.where(outward, near, far)] - middle,
        head=centre[np.where(outward, far, near)] - middle,
        axis=step / length[:, None],
        radius=clip_radius(spacing, i, j),
    )


def _heeded(sites, spacing, block):
    """The members of a block, of those far finer than its own ones one in each cell of a grid as fine; and which of
    these are its own, and which finer."""
    own = np.isin(block.members, block.own, assume_unique=True)
    size = _FINER * np.median(spacing[block.own])
    finer = ~own & (spacing[block.members] < size)
    row, kept = np.flatnonzero(finer), ~finer
    if len(row):
        cell = np.floor(sites[block.members[row]] / size).astype(np.int64)
        kept[row[np.unique(cell, axis=0, return_index=True)[1]]] = True
    return block.members[kept], own[kept], finer[kept]


def _tetrahedra(sites):
    """The Delaunay tetrahedra; where distances of very different sizes are too much for Qhull, those of the sites in a
    frame of their own, moved a little at random (its option QJ)."""
    try:
        return Delaunay(sites)
    except QhullError:
        away = sites - sites.mean(axis=0)
    try:
        return Delaunay(away / np.abs(away).max(), qhull_options="Qbb Qc QJ")
    except QhullError as error:
        size, least = np.abs(away).max(), KDTree(sites).query(sites, k=2)[0][:, 1].min()
        raise InputError(
            f"some points lie {least / size:.1g} times the size of their surroundings apart, too close for a Voronoi "
            "diagram; thin them there, or reconstruct parts that lie far from each other one by one"
        ) from error


def clip_radius(spacing, i, j):
    """Radius of the ball that the facet of samples i and j is clipped to, in the units of `spacing`."""
    return 0.5 * CLIP_RADIUS * (spacing[i] + spacing[j])


def inside_ball(sides: FacetSides) -> tuple[np.ndarray, np.ndarray]:
    """Where each side enters and leaves the ball, both (s,) in [0,1] from tail to head; equal where it stays out."""
    step = sides.head - sides.tail
    a, b = row_dots(step, step), row_dots(step, sides.tail)
    discriminant = b * b - a * (row_dots(sides.tail, sides.tail) - sides.radius**2)
    root, a = np.sqrt(np.maximum(discriminant, 0.0)), np.maximum(a, np.finfo(np.float64).tiny)
    hit = discriminant > 0
    return np.where(hit, np.clip((-b - root) / a, 0, 1), 0.0), np.where(hit, np.clip((-b + root) / a, 0, 1), 0.0)


def _swept_area(sides):
    """Signed area, inside the ball, of the triangle between the midpoint and each side: a triangle over the part of
    the side that is inside, a circular sector over each part that is not."""
    enter, leave = inside_ball(sides)
    tt, th, hh = row_dots(sides.tail, sides.tail), row_dots(sides.tail, sides.head), row_dots(sides.head, sides.head)
    turn = row_dots(np.cross(sides.tail, sides.head), sides.axis)
    before = np.arctan2(enter * turn, (1 - enter) * tt + enter * th)
    after = np.arctan2((1 - leave) * turn, (1 - leave) * th + leave * hh)
    return 0.5 * (sides.radius**2 * (before + after) + (leave - enter) * turn)


def _corners(sites, beyond):
    """(4,3) sites of a tetrahedron around all others, more than `beyond` from each. The eight corners of a box would
    serve as well, but they lie on a sphere, which takes Qhull half as long again."""
    low, high = sites.min(axis=0), sites.max(axis=0)
    half = 0.5 * (high - low).max()
    reach = max(_CORNER_DISTANCE * half, half + beyond)
    return 0.5 * (low + high) + reach * _TETRAHEDRON


def _circumcentres(sites, simplices):
    """(t,3) circumcentres of tetrahedra, and (t,) bool, whether each is positively oriented."""
    origin = sites[simplices[:, 0]]
    a, b, c = (sites[simplices[:, k]] - origin for k in (1, 2, 3))
    bc, ca, ab = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = row_dots(a, bc)
    numerator = row_dots(a, a)[:, None] * bc + row_dots(b, b)[:, None] * ca + row_dots(c, c)[:, None] * ab
    positive = volume >= 0
    flat = np.finfo(np.float64).tiny
    safe = np.where(np.abs(volume) < flat, np.where(positive, flat, -flat), volume)
    with np.errstate(over="ignore"):
        offset = numerator / (2 * safe[:, None])
    farthest = _FARTHEST * np.abs(sites).max()
    return origin + np.clip(offset, -farthest, farthest), positive
