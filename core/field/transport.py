"""The distance carried outwards from the foot points of the nodes near the surface.

Every node takes a foot that is close to it, in three steps from coarse to fine. Blocks of 2^3 nodes take a foot of
their own nodes or, by an exact Euclidean distance transform, of the nearest block that has one; from foot to foot of
the nodes beside they climb to closer ones, and compare theirs with those of the blocks around. Nodes start from their
block's, compare it with their neighbours' (vector distance propagation; P.-E. Danielsson, Computer Graphics and Image
Processing 14, 1980), and look where they fall on the plane of its disc. The distance is that to the disc of this foot
alone: the least of many discs' is too small where the feet scatter.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import distance_transform_edt

from ..linalg import dots
from ..parallel import work_through
from ..progress import Progress
from .feet import Feet
from .grid import Grid, node_strides

_BLOCK = 2  # nodes along each axis
_ROUNDS, _STEPS = 2, 2  # of blocks with those around, each after so many steps from foot to foot
_NEAR = 6.0  # cells from its foot, up to which a node looks for a better one where this one's disc is closest to it
_SLAB = 1 << 17  # nodes
_PIECE = 1 << 15  # blocks


def transport(grid: Grid, node: np.ndarray, feet: Feet, progress=None) -> tuple[np.ndarray, np.ndarray]:
    """Distances at all nodes of the grid, float32 of its shape, from the feet that some nodes (s,) have, by their flat
    indices in ascending order; and which foot that is, int32."""
    grid = replace(grid, origin=np.zeros(3))  # the feet are relative to it
    progress, slabs = Progress.of(progress), _slabs(grid, _SLAB)
    row = _close_feet(grid, node, feet, progress.part(0.0, 0.8))
    values = np.empty(grid.shape, np.float32)

    def measure(slab):
        values[slab] = feet.distance(_positions(grid, slab), row[slab])

    work_through(measure, progress.part(0.8, 1.0).each(slabs))
    return values, row


def _close_feet(grid, node, feet, progress):
    """The number of a foot close to each node of the grid, int32 of its shape."""
    row, number = np.empty(grid.shape, np.int32), np.full(grid.shape, -1, np.int32)
    number.flat[node] = np.arange(len(node), dtype=np.int32)
    of_block = _feet_of_blocks(grid, node, number, feet, progress.part(0.0, 0.5))

    def spread(slab):
        found = of_block[np.arange(slab.start, slab.stop) // _BLOCK]
        for axis in (1, 2):
            found = found.repeat(_BLOCK, axis)
        row[slab] = found[:, : grid.shape[1], : grid.shape[2]]

    work_through(spread, progress.part(0.5, 0.6).each(_slabs(grid, _SLAB)))
    row.flat[node] = np.arange(len(node), dtype=np.int32)
    held = _Held.beyond_all(grid.shape)
    held.compare(grid, feet, row, progress.part(0.6, 0.75))
    look = partial(held.look_below, grid, number, feet, row)
    work_through(look, progress.part(0.75, 0.85).each(_slabs(grid, _SLAB)))
    held.compare(grid, feet, row, progress.part(0.85, 1.0))
    return row


def _feet_of_blocks(grid, node, number, feet, progress):
    """The number of a foot close to the middle of each block of nodes, int32 of the blocks' shape."""
    blocks = _blocks(grid)
    home = np.stack(np.unravel_index(node, grid.shape)) // _BLOCK
    own = np.full(blocks.shape, -1, np.int32)
    own[tuple(home)] = np.arange(len(node), dtype=np.int32)
    progress(0.0)
    row = own[tuple(distance_transform_edt(own < 0, return_distances=False, return_indices=True))]
    beside, held = _beside(grid, node, number), _Held.beyond_all(blocks.shape)
    for _, part in progress.part(0.4, 1.0).turns(range(_ROUNDS)):
        climb = partial(_climb, blocks, feet, beside, row)
        work_through(climb, part.part(0.0, 0.6).each(_slabs(blocks, _PIECE)))
        held.compare(blocks, feet, row, part.part(0.6, 1.0))
    return row


def _blocks(grid):
    """The grid of the middles of blocks of nodes; those at its far ends may reach past it."""
    shape = tuple(-(-n // _BLOCK) for n in grid.shape)
    return Grid(grid.origin + 0.5 * (_BLOCK - 1) * grid.spacing, _BLOCK * grid.spacing, shape)


def _beside(grid, node, number):
    """Which of some nodes (s,) are next to each along an axis, from the `number` (nx,ny,nz) of each, -1 elsewhere: six
    (s,) int32, itself where none is. A node at a side of the box may get one at the side across, too far to be taken.
    """
    around = [step for stride in node_strides(grid.shape) for step in (-stride, stride)]
    itself, others = np.arange(len(node), dtype=np.int32), (number.take(node + step, mode="clip") for step in around)
    return [np.where(other >= 0, other, itself) for other in others]


def _climb(blocks, feet, beside, row, slab):
    """Put into `row` of a slab of blocks feet of the nodes `beside` those whose feet they have, where these are closer,
    a few times."""
    x, best = _positions(blocks, slab), row[slab]
    for _ in range(_STEPS):
        best = feet.closest(x, [best, *(others.take(best) for others in beside)])
    row[slab] = best


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

    def compare(self, grid, feet, row, progress):
        """Put into `row` (nx,ny,nz) the feet of neighbours that are closer to nodes than their own."""
        slabs = _slabs(grid, _SLAB)
        work_through(partial(self.measure, grid, feet, row), progress.part(0.0, 0.5).each(slabs))
        closer = partial(self.take_closest, np.float32(grid.spacing), row)
        work_through(closer, progress.part(0.5, 1.0).each(slabs))

    def measure(self, grid, feet, row, slab):
        """Hold the feet that `row` has at the nodes of a slab."""
        here = slice(slab.start + 1, slab.stop + 1), slice(-1), slice(-1)
        offset = feet.offsets(_positions(grid, slab), row[slab])
        self.row[here], self.offset[:, *here], self.squared[here] = row[slab], offset, dots(offset, offset)

    def look_below(self, grid, number, feet, row, slab):
        """Put into `row` of a slab, for nodes near their feet, the foot of the node where they fall on the plane of
        the disc, whose `number` (nx,ny,nz) may be -1 for none, if it is closer."""
        limit = np.float32((_NEAR * grid.spacing) ** 2)
        at = np.nonzero(self.squared[slab.start + 1 : slab.stop + 1, :-1, :-1] <= limit)
        x, own = [along.take(i) for along, i in zip(_axes(grid, slab), at, strict=True)], row[slab][at]
        normal = [each.take(own) for each in feet.normals]
        height = dots(feet.offsets(x, own), normal)
        cells = [(x[a] - height * normal[a]) / np.float32(grid.spacing) for a in range(3)]
        below = [np.rint(each).clip(0, n - 1).astype(np.int32) for each, n in zip(cells, grid.shape, strict=True)]
        other = number[tuple(below)]
        row[slab][at] = feet.closest(x, [own, np.where(other >= 0, other, own)])

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


def _slabs(grid, nodes):
    """Slices of the first axis with at most so many nodes, but one layer at least."""
    thickness = max(1, nodes // (grid.shape[1] * grid.shape[2]))
    return [slice(first, min(first + thickness, grid.shape[0])) for first in range(0, grid.shape[0], thickness)]


def _axes(grid, slab):
    """Coordinates of the nodes of a slab along each axis, (s,), (ny,) and (nz,) float32."""
    x, y, z = ((grid.origin[a] + grid.spacing * np.arange(grid.shape[a])).astype(np.float32) for a in range(3))
    return x[slab], y, z


def _positions(grid, slab):
    """Positions of the nodes of a slab, (3,s,ny,nz) float32."""
    return np.stack(np.meshgrid(*_axes(grid, slab), indexing="ij"))
