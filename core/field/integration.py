"""From the local surface to distances in the whole box.

Near the surface the blended projection distance is accurate and is kept. Further out the paper solves a Poisson
equation, see :mod:`poisson`. By default the distance is carried from the foot points of the near nodes instead, which
errs less, most of all at the medial axis, and needs no linear solve: every node takes the foot of the nearest such node
(an exact Euclidean distance transform finds it), compares it with the feet its neighbours hold, and keeps the closest
(vector distance propagation; P.-E. Danielsson, Computer Graphics and Image Processing 14, 1980).
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..progress import Progress
from .borders import DISC
from .grid import Grid
from .local_surface import LocalSurface
from .poisson import poisson

BAND = 2.0  # cells, where the projection distance itself is kept
_SEED_BAND = 1.5  # cells, nodes whose foot points carry the distance outwards
_SETTLED = 0.1  # cells, residual of a foot point that counts
_FOOT_RADIUS = 0.6  # cells, a foot point stands for a disc of this radius
_ROUNDS = 2
_SLAB = 1 << 18  # nodes


@dataclass(frozen=True)
class NearBand:
    """The nodes within BAND cells of the surface.

    node : (b,) int64, flat index in the grid     step : (b,3) float64, from the foot point to the node
    """

    node: np.ndarray
    step: np.ndarray


def distance_field(
    surface: LocalSurface, grid: Grid, integration: str = "transport", progress=None
) -> tuple[np.ndarray, NearBand]:
    """Unsigned distance at every node of the grid, float32 of its shape, in the units of the samples, and the band
    in which it is known with its direction. Outside the band by `integration`: "transport" or "poisson"."""
    progress = Progress.of(progress)
    node, bound = _near_samples(surface, grid)
    near = surface.project(grid.positions(node), progress.part(0.05, 0.6))
    inside = near.distance <= BAND * grid.spacing
    node, near = node[inside], near[inside]
    if integration == "poisson":
        known = np.full(grid.shape, np.nan)
        known.flat[node] = near.distance
        values = poisson(surface, grid, known, progress.part(0.6, 1.0))
    else:
        feet = _settled_feet(surface, grid, node, near, progress.part(0.6, 0.8))
        values = _transport(grid, *feet, progress.part(0.8, 1.0))
    values = np.clip(values, 0, bound)
    values.flat[node] = near.distance
    return values, NearBand(node, near.step)


def _near_samples(surface, grid):
    """Flat index of every node that may lie within the band of the patches, and the distance of every node to a sample
    that is nearest or nearly so, float32 of the grid's shape: more than the distance to the surface can be."""
    home = grid.nearest_nodes(surface.points)
    held = np.full(grid.shape, -1, np.int32)
    held.flat[home] = np.arange(len(home), dtype=np.int32)
    reach = np.zeros(grid.shape, np.float32)
    own = np.maximum(DISC * surface.spacing, surface.rims.reach) / grid.spacing
    np.maximum.at(reach.reshape(-1), home, own.astype(np.float32))
    distance, nearest = distance_transform_edt(held < 0, return_indices=True)
    nearest = np.ravel_multi_index(tuple(nearest), grid.shape)
    near = np.flatnonzero(distance <= BAND + 0.5 * np.sqrt(3) + reach.flat[nearest])
    sample = held.flat[nearest]
    points = surface.points.astype(np.float32)
    return near, np.concatenate([_lengths(x - points[sample[slab]]) for slab, x in _slabs(grid)])


def _settled_feet(surface, grid, node, near, progress):
    """Nodes close to the surface, (s,), their foot points that survive a second projection, (s,3), the unit normal
    there, (s,3), and the radius for which a foot point stands: 0 on rims, (s,)."""
    seed = near.distance <= _SEED_BAND * grid.spacing
    node, near = node[seed], near[seed]
    feet = grid.positions(node) - near.step
    again = surface.project(feet, progress)
    kept = again.distance <= _SETTLED * grid.spacing
    node, near, feet = node[kept], near[kept], feet[kept] - again.step[kept]
    normals = near.step / np.maximum(near.distance, np.finfo(float).tiny)[:, None]
    return node, feet, normals, np.where(near.past_rim, 0.0, _FOOT_RADIUS * grid.spacing)


def _transport(grid, node, feet, normals, radius, progress):
    row = np.full(grid.shape, -1, np.int32)
    row.flat[node] = np.arange(len(node), dtype=np.int32)
    nearest = distance_transform_edt(row < 0, return_distances=False, return_indices=True)
    row = row[tuple(nearest)]
    del nearest
    discs = feet.astype(np.float32), normals.astype(np.float32), radius.astype(np.float32)
    values = np.empty(grid.shape, np.float32)
    for turn in range(_ROUNDS):
        held = row.copy()
        for slab, at in _slabs(grid):
            progress((turn + slab.start / grid.shape[0]) / _ROUNDS)
            best = _distance_to_discs(at, *discs, row[slab])
            for other in _neighbours(row, slab):
                distance = _distance_to_discs(at, *discs, other)
                closer = distance < best
                best[closer] = distance[closer]
                held[slab][closer] = other[closer]
            values[slab] = best
        row = held
    return values


def _slabs(grid):
    """Slices of the first axis and the positions of their nodes, (s,ny,nz,3) float32, a bounded number at a time."""
    x = [(grid.origin[a] + grid.spacing * np.arange(grid.shape[a])).astype(np.float32) for a in range(3)]
    thickness = max(1, _SLAB // (grid.shape[1] * grid.shape[2]))
    for first in range(0, grid.shape[0], thickness):
        slab = slice(first, min(first + thickness, grid.shape[0]))
        yield slab, np.stack(np.meshgrid(x[0][slab], x[1], x[2], indexing="ij"), axis=-1)


def _lengths(vectors):
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def _distance_to_discs(x, centres, normals, radius, row):
    """Distance to the disc that each foot point stands for."""
    offset = x - centres[row]
    height = np.einsum("...i,...i->...", offset, normals[row])
    lateral = np.sqrt(np.maximum(np.einsum("...i,...i->...", offset, offset) - height**2, 0))
    return np.hypot(height, np.maximum(lateral - radius[row], 0))


def _neighbours(row, slab):
    """What the six neighbours of the slab's nodes hold; a node at the edge of the box is its own neighbour."""
    for axis in range(3):
        for shift in (-1, 1):
            index = np.clip(np.arange(row.shape[axis]) + shift, 0, row.shape[axis] - 1)
            yield row[index[slab]] if axis == 0 else np.take(row[slab], index, axis=axis)
