"""From the local surface to distances in the whole box.

Near the surface the blended projection distance is accurate and is kept, but where a foot point is closer: between
patches that do not quite meet. Further out the paper solves a Poisson equation, see :mod:`poisson`. By default the
distance is carried from the foot points of the near nodes instead, which errs less, most of all at the medial axis, and
needs no linear solve: every node takes the foot of the nearest such node (an exact Euclidean distance transform finds
it), compares it with the feet its neighbours hold, and keeps the closest (vector distance propagation; P.-E.
Danielsson, Computer Graphics and Image Processing 14, 1980). The distance is then that to the disc of this foot alone:
the least of many discs' is too small where the feet scatter.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..linalg import dots
from ..parallel import work_through
from ..progress import Progress
from ..settings import Settings
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
    with directions by `diffusion`: "kernel" or "grid". Raises :class:`SettingsError` for other words."""
    Settings(integration=integration, diffusion=diffusion)
    progress = Progress.of(progress)
    node, near = _projected(surface, grid, progress.part(0.0, 0.6))
    if integration == "poisson":
        known = np.full(grid.shape, np.nan)
        known.flat[node] = near.distance
        values = poisson(surface, grid, known, diffusion, progress.part(0.6, 1.0))
        values.flat[node] = near.distance
    else:
        held, feet = settled_feet(surface, grid, node, near, progress.part(0.6, 0.8))
        values = _transport(grid, held, feet, progress.part(0.8, 1.0))
        values.flat[node] = no_farther_than_feet(near.distance, values.flat[node], grid)
    return values, NearBand(grid.shape, node, near.step, near.past_rim, near.sample)


def near_band(surface: LocalSurface, grid: Grid, progress=None) -> NearBand:
    """The band of :func:`distance_field` alone: the nodes within two cells of the surface."""
    node, near = _projected(surface, grid, Progress.of(progress))
    return NearBand(grid.shape, node, near.step, near.past_rim, near.sample)


def _projected(surface, grid, progress):
    """Flat indices of the nodes within the band, and where they fall on the surface."""
    node = near_nodes(surface, grid, BAND, progress.part(0.0, 0.1))
    near = surface.project(grid.positions(node), progress.part(0.1, 1.0), FROM_NODES)
    inside = near.distance <= BAND * grid.spacing
    return node[inside], near[inside]


def _transport(grid, node, feet, progress):
    slabs = _slabs(grid)
    row = _closest(grid, node, feet, slabs, progress.part(0.0, 0.9))
    values = np.empty(grid.shape, np.float32)

    def measure(slab):
        values[slab] = feet.distance(_positions(grid, slab), row[slab])

    work_through(measure, progress.part(0.9, 1.0).each(slabs))
    return values


def _closest(grid, node, feet, slabs, progress):
    """The number of a foot close to each node of the grid, int32 of its shape: that of the nearest of the nodes (s,)
    that have one each, or one that its neighbours hold."""
    row, held = _nearest(grid, node, slabs, progress.part(0.0, 0.4)), _Held.beyond_all(grid.shape)
    for turn in range(_ROUNDS):
        part = progress.part(0.4 + 0.2 * turn, 0.6 + 0.2 * turn)
        work_through(partial(held.measure, grid, feet, row), part.part(0.0, 0.5).each(slabs))
        closer = partial(held.take_closest, np.float32(grid.spacing), row)
        work_through(closer, part.part(0.5, 1.0).each(slabs))
    return row


def _nearest(grid, node, slabs, progress):
    """Which of some nodes (s,) is nearest to each node of the grid, int32 of its shape."""
    row, number = np.empty(grid.shape, np.int32), np.full(grid.shape, -1, np.int32)
    number.flat[node] = np.arange(len(node), dtype=np.int32)
    progress(0.0)
    nearest = distance_transform_edt(number < 0, return_distances=False, return_indices=True)

    def look_up(slab):
        row[slab] = number.take(np.ravel_multi_index(tuple(nearest[:, slab]), grid.shape))

    work_through(look_up, progress.part(0.8, 1.0).each(slabs))
    return row


@dataclass(frozen=True)
class _Held:
    """The foot that each node holds, in a box with a layer more at both ends of its first axis and at the far end of
    the others: neighbours are a fixed step away in memory, and those past the box infinitely far from their feet.

    row : (nx+2,ny+1,nz+1) int32, its number     offset : (3,...) float32, from it to the node     squared : its square
    """

    row: np.ndarray
    offset: np.ndarray
    squared: np.ndarray

    @classmethod
    def beyond_all(cls, shape) -> "_Held":
        box = shape[0] + 2, shape[1] + 1, shape[2] + 1
        return cls(np.zeros(box, np.int32), np.zeros((3, *box), np.float32), np.full(box, np.inf, np.float32))

    def measure(self, grid, feet, row, slab):
        """Hold the feet that `row` has at the nodes of a slab."""
        here = slice(slab.start + 1, slab.stop + 1), slice(-1), slice(-1)
        offset = feet.offsets(_positions(grid, slab), row[slab])
        self.row[here], self.offset[:, *here], self.squared[here] = row[slab], offset, dots(offset, offset)

    def take_closest(self, cell, row, slab):
        """Put into `row` the feet of neighbours that are closer to the nodes of a slab than their own. One cell h on
        along an axis, with unit direction e, a foot at the offset o is at |o + h e|^2 = |o|^2 + 2 h o.e + h^2."""
        offset, squared, before = self.offset.reshape(3, -1), self.squared.reshape(-1), self.row.reshape(-1)
        layer = self.row[0].size
        first, last = (slab.start + 1) * layer, (slab.stop + 1) * layer
        mine, best = before[first:last].copy(), squared[first:last].copy()
        for along, stride in zip(offset, (layer, self.row.shape[2], 1), strict=True):
            for step in (-1, 1):
                theirs = slice(first + step * stride, last + step * stride)
                found = along[theirs] * (-2 * step * cell)
                found += squared[theirs]
                found += cell * cell
                closer = np.flatnonzero(found < best)
                best[closer], mine[closer] = found.take(closer), before[theirs].take(closer)
        row[slab] = mine.reshape(-1, *self.row.shape[1:])[:, :-1, :-1]


def _slabs(grid):
    """Slices of the first axis with a bounded number of nodes."""
    thickness = max(1, _SLAB // (grid.shape[1] * grid.shape[2]))
    return [slice(first, min(first + thickness, grid.shape[0])) for first in range(0, grid.shape[0], thickness)]


def _positions(grid, slab):
    """Positions of the nodes of a slab, (3,s,ny,nz) float32."""
    x = [(grid.origin[a] + grid.spacing * np.arange(grid.shape[a])).astype(np.float32) for a in range(3)]
    return np.stack(np.meshgrid(x[0][slab], x[1], x[2], indexing="ij"))
