"""From the local surface to distances in the whole box.

Near the surface the blended projection distance is accurate and is kept. Further out the paper solves a Poisson
equation, see :mod:`poisson`. By default the distance is carried from the foot points of the near nodes instead, which
errs less, most of all at the medial axis, and needs no linear solve: every node takes the foot of the nearest such node
(an exact Euclidean distance transform finds it), compares it with the feet its neighbours hold, and keeps the closest
(vector distance propagation; P.-E. Danielsson, Computer Graphics and Image Processing 14, 1980). The distance is then
that to the disc of this foot alone: the least of many discs' is too small where the feet scatter.
"""

from functools import partial

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..parallel import in_order
from ..progress import Progress
from .borders import DISC
from .feet import settled_feet
from .grid import Grid
from .local_surface import LocalSurface
from .poisson import poisson
from .steps import NearBand

BAND = 2.0  # cells, where the projection distance itself is kept
_ROUNDS = 2
_SLAB = 1 << 17  # nodes


def distance_field(
    surface: LocalSurface, grid: Grid, integration: str = "transport", diffusion: str = "kernel", progress=None
) -> tuple[np.ndarray, NearBand]:
    """Unsigned distance at every node of the grid, float32 of its shape, in the units of the samples, and the band
    in which it is known with its direction. Outside the band by `integration`: "transport" or "poisson", the latter
    with directions by `diffusion`: "kernel" or "grid"."""
    progress = Progress.of(progress)
    node, bound = _near_samples(surface, grid, progress.part(0.0, 0.05))
    near = surface.project(grid.positions(node), progress.part(0.05, 0.6))
    inside = near.distance <= BAND * grid.spacing
    node, near = node[inside], near[inside]
    if integration == "poisson":
        known = np.full(grid.shape, np.nan)
        known.flat[node] = near.distance
        values = poisson(surface, grid, known, diffusion, progress.part(0.6, 1.0))
    else:
        held, feet = settled_feet(surface, grid, node, near, progress.part(0.6, 0.8))
        values = _transport(grid, held, feet, progress.part(0.8, 1.0))
    values = np.clip(values, 0, bound)
    values.flat[node] = near.distance
    return values, NearBand(node, near.step)


def sample_reach(surface: LocalSurface) -> np.ndarray:
    """How far the patch of each sample covers the surface, (n,), units of the samples."""
    rims = surface.rims
    return np.maximum(np.maximum(DISC * surface.spacing, rims.reach), rims.margin.max(axis=1))


def _near_samples(surface, grid, progress):
    """Flat index of every node that may lie within the band of the patches, and the distance of every node to a sample
    that is nearest or nearly so, float32 of the grid's shape: more than the distance to the surface can be."""
    home = grid.nearest_nodes(surface.points)
    held = np.full(grid.shape, -1, np.int32)
    held.flat[home] = np.arange(len(home), dtype=np.int32)
    reach = np.zeros(grid.shape, np.float32)
    np.maximum.at(reach.reshape(-1), home, (sample_reach(surface) / grid.spacing).astype(np.float32))
    progress(0.0)
    distance, nearest = distance_transform_edt(held < 0, return_indices=True)
    progress(0.8)
    nearest = np.ravel_multi_index(tuple(nearest), grid.shape)
    near = np.flatnonzero(distance <= BAND + 0.5 * np.sqrt(3) + reach.flat[nearest])
    sample = held.flat[nearest]
    points = np.ascontiguousarray(surface.points.T, np.float32)
    bound = np.empty(grid.shape, np.float32)
    for slab in progress.part(0.8, 1.0).each(_slabs(grid)):
        row = sample[slab]
        bound[slab] = np.sqrt(sum((x - p[row]) ** 2 for x, p in zip(_positions(grid, slab), points, strict=True)))
    return near, bound


def _transport(grid, node, feet, progress):
    row = np.full(grid.shape, -1, np.int32)
    row.flat[node] = np.arange(len(node), dtype=np.int32)
    progress(0.0)
    nearest = distance_transform_edt(row < 0, return_distances=False, return_indices=True)
    progress(0.0)
    row = row[tuple(nearest)]
    del nearest
    values = np.empty(grid.shape, np.float32)
    changed = np.ones(grid.shape, bool)
    for turn in range(_ROUNDS):
        held = row.copy()
        slabs = progress.part(turn / _ROUNDS, (turn + 1) / _ROUNDS).each(_slabs(grid))
        for _ in in_order(partial(_take_closest, grid, feet, row, changed, held, values), slabs):
            pass
        changed, row = held != row, held
    return values


def _take_closest(grid, feet, row, changed, held, values, slab):
    """Where a foot of a neighbour that changed is closer than a node's own, put it into `held`; then the distances to
    the feet's discs into `values`."""
    at, mine = _positions(grid, slab).reshape(3, -1), held[slab].reshape(-1)
    best = feet.squared(at, mine)
    for other, fresh in zip(_neighbours(row, slab), _neighbours(changed, slab), strict=True):
        other = other.reshape(-1)
        tried = np.flatnonzero(fresh.reshape(-1) & (other != mine))
        squared = feet.squared(at[:, tried], other[tried])
        closer = squared < best[tried]
        tried = tried[closer]
        best[tried], mine[tried] = squared[closer], other[tried]
    values[slab] = feet.distance(at, mine).reshape(values[slab].shape)


def _slabs(grid):
    """Slices of the first axis with a bounded number of nodes."""
    thickness = max(1, _SLAB // (grid.shape[1] * grid.shape[2]))
    return [slice(first, min(first + thickness, grid.shape[0])) for first in range(0, grid.shape[0], thickness)]


def _positions(grid, slab):
    """Positions of the nodes of a slab, (3,s,ny,nz) float32."""
    x = [(grid.origin[a] + grid.spacing * np.arange(grid.shape[a])).astype(np.float32) for a in range(3)]
    return np.stack(np.meshgrid(x[0][slab], x[1], x[2], indexing="ij"))


def _neighbours(row, slab):
    """What the six neighbours of the slab's nodes hold; a node at the edge of the box is its own neighbour."""
    for axis in range(3):
        for shift in (-1, 1):
            index = np.clip(np.arange(row.shape[axis]) + shift, 0, row.shape[axis] - 1)
            yield row[index[slab]] if axis == 0 else np.take(row[slab], index, axis=axis)
