"""From the local surface to distances in the whole box.

Near the surface the blended projection distance is accurate and is kept, but where a foot point is closer: between
patches that do not quite meet. Further out the paper solves a Poisson equation, see :mod:`poisson`. By default the
distance is carried from the foot points of the near nodes instead, which errs less, most of all at the medial axis, and
needs no linear solve: every node takes the foot of the nearest such node (an exact Euclidean distance transform finds
it), compares it with the feet its neighbours hold, and keeps the closest (vector distance propagation; P.-E.
Danielsson, Computer Graphics and Image Processing 14, 1980). The distance is then that to the disc of this foot alone:
the least of many discs' is too small where the feet scatter.
"""

from functools import partial

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..parallel import in_order
from ..progress import Progress
from .feet import no_farther_than_feet, settled_feet
from .grid import Grid
from .local_surface import LocalSurface
from .near_nodes import near_nodes
from .poisson import poisson
from .projection import FROM_NODES
from .steps import NearBand

BAND = 2.0  # cells, where the projection distance itself is kept
_ROUNDS = 3
_SLAB = 1 << 17  # nodes


def distance_field(
    surface: LocalSurface, grid: Grid, integration: str = "transport", diffusion: str = "kernel", progress=None
) -> tuple[np.ndarray, NearBand]:
    """Unsigned distance at every node of the grid, float32 of its shape, in the units of the samples, and the band
    in which it is known with its direction. Outside the band by `integration`: "transport" or "poisson", the latter
    with directions by `diffusion`: "kernel" or "grid"."""
    progress = Progress.of(progress)
    node = near_nodes(surface, grid, BAND, progress.part(0.0, 0.05))
    near = surface.project(grid.positions(node), progress.part(0.05, 0.6), FROM_NODES)
    inside = near.distance <= BAND * grid.spacing
    node, near = node[inside], near[inside]
    if integration == "poisson":
        known = np.full(grid.shape, np.nan)
        known.flat[node] = near.distance
        values = poisson(surface, grid, known, diffusion, progress.part(0.6, 1.0))
        values.flat[node] = near.distance
    else:
        held, feet = settled_feet(surface, grid, node, near, progress.part(0.6, 0.8))
        values = _transport(grid, held, feet, progress.part(0.8, 1.0))
        values.flat[node] = no_farther_than_feet(near.distance, values.flat[node], grid)
    return values, NearBand(node, near.step, near.past_rim)


def _transport(grid, node, feet, progress):
    held = np.full(grid.shape, -1, np.int32)
    held.flat[node] = np.arange(len(node), dtype=np.int32)
    progress(0.0)
    nearest = distance_transform_edt(held < 0, return_distances=False, return_indices=True)
    row, squared, values = np.empty_like(held), np.empty(grid.shape, np.float32), np.empty(grid.shape, np.float32)
    slabs, steps = _slabs(grid), _ROUNDS + 2

    def begin(slab):
        row[slab] = held.take(np.ravel_multi_index(tuple(nearest[:, slab]), grid.shape))
        squared[slab] = feet.squared(_positions(grid, slab), row[slab])

    def finish(slab):
        values[slab] = feet.distance(_positions(grid, slab), row[slab])

    def by_slabs(work, step):
        for _ in in_order(work, progress.part(step / steps, (step + 1) / steps).each(slabs)):
            pass

    by_slabs(begin, 0)
    changed = np.ones(grid.shape, bool)
    for turn in range(_ROUNDS):
        held = row.copy()
        by_slabs(partial(_take_closest, grid, feet, row, changed, held, squared), 1 + turn)
        changed, row = held != row, held
    by_slabs(finish, steps - 1)
    return values


def _take_closest(grid, feet, row, changed, held, squared, slab):
    """Where a foot of a neighbour that changed is closer than a node's own, put it into `held` and its squared distance
    into `squared`."""
    at, mine, best = _positions(grid, slab).reshape(3, -1), held[slab].reshape(-1), squared[slab].reshape(-1)
    for other, fresh in zip(_neighbours(row, slab), _neighbours(changed, slab), strict=True):
        other = other.reshape(-1)
        tried = np.flatnonzero(fresh.reshape(-1) & (other != mine))
        other = other[tried]
        found = feet.squared(at.take(tried, axis=1), other)
        closer = found < best[tried]
        tried = tried[closer]
        best[tried], mine[tried] = found[closer], other[closer]


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
