"""The nodes of a narrow band in groups of 2^3, told from the samples alone.

Blocks, then groups of 4^3 and of 2^3 nodes are left out where their nearest sample is too far for the surface to come
near.
"""

from dataclasses import dataclass

import numpy as np

from ..progress import Progress
from .blocks import SIDE, table_shape
from .grid import CORNERS, Grid, node_strides
from .local_surface import LocalSurface
from .near_nodes import sample_reach
from .steps import NodeSet

HALF = 0.5 * np.sqrt(3)  # cells, from the middle of a group of 2^3 nodes to each of them
MARGIN = 1.0  # cells, by which a projection may err in leaving a group out
_ERROR = 0.05  # the same around sparse samples, relative to how far their patches reach
_SPARSE = 4.0  # sides of a group; patches that reach further are sparse
_PIECE = 1 << 11  # blocks, or pairs of them, at a time


@dataclass(frozen=True)
class Groups:
    """Groups of 2^3 nodes of a grid; at its far sides some of them lie outside.

    corner : (g,3) int32, indices (i,j,k) of their lowest nodes, which are even; in C order
    sample : (g,) int32, the sample nearest to their middle
    """

    grid: Grid
    corner: np.ndarray
    sample: np.ndarray

    def __len__(self) -> int:
        return len(self.corner)

    def __getitem__(self, rows) -> "Groups":
        return Groups(self.grid, self.corner[rows], self.sample[rows])

    @property
    def middles(self) -> np.ndarray:
        """(g,3) float64."""
        return middles_of(self.grid, self.corner, 2)

    def to_samples(self, surface: LocalSurface) -> np.ndarray:
        """(g,) float64, distances from the middles to those samples."""
        return np.linalg.norm(self.middles - surface.points[self.sample], axis=1)

    def members(self, octant: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nodes of the groups at an `octant` of :data:`CORNERS`: their flat indices (m,), and which group each is
        in, ascending."""
        at = self.corner + octant.astype(np.int32)
        group = np.flatnonzero((at < self.grid.shape).all(axis=1))
        return at[group] @ node_strides(self.grid.shape), group

    def lattice(self) -> NodeSet:
        """The groups as nodes of a grid with half as many along each axis."""
        shape = tuple(-(-n // 2) for n in self.grid.shape)
        return NodeSet(shape, self.corner // 2 @ node_strides(shape))


def groups_near(surface: LocalSurface, grid: Grid, width: float, progress: Progress) -> Groups:
    """Those with nodes that may lie within `width` cells of the surface. Around sparse samples, which would claim all
    nodes as far as their patches reach, larger groups are projected onto the surface first."""
    block, reach = _blocks(surface, grid, width)
    corner = SIDE * np.stack(np.unravel_index(block, table_shape(grid.shape)), axis=1).astype(np.int32)
    found = []
    for rows in progress.chunks(len(block), _PIECE):
        part, far = corner[rows], reach[rows]
        for side in (SIDE, 4, 2):
            if side < SIDE:
                part = (part[:, None] + side * CORNERS.astype(np.int32)).reshape(-1, 3)
                far = np.repeat(far, 8)
            middle = middles_of(grid, part, side)
            distance, sample = surface.tree.query(middle, workers=-1)
            kept = distance <= grid.spacing * (width + far + HALF * (side - 1))
            wide = np.flatnonzero(kept & (far > _SPARSE * side)) if side > 2 else []
            room = width + HALF * (side - 1) + MARGIN + _ERROR * far[wide]
            kept[wide] = surface.project(middle[wide]).distance <= grid.spacing * room
            part, far, sample = part[kept], far[kept], sample[kept]
        inside = (part < grid.shape).all(axis=1)
        found.append(Groups(grid, part[inside], sample[inside].astype(np.int32)))
    groups = Groups(grid, *(np.concatenate([getattr(part, name) for part in found]) for name in ("corner", "sample")))
    return groups[np.argsort(groups.corner @ node_strides(grid.shape))]


def _blocks(surface, grid, width):
    """Flat indices, ascending, of the blocks with nodes that may lie within the width of the patch of their nearest
    sample, and how far the patches of the samples reach that may be nearest there, cells."""
    table = np.array(table_shape(grid.shape))
    reach = sample_reach(surface) / grid.spacing
    home = np.floor((surface.points - grid.origin) / (SIDE * grid.spacing)).astype(np.int64)
    home, row = np.unique(np.ravel_multi_index(tuple(home.T), tuple(table)), return_inverse=True)
    farthest = np.zeros(len(home))
    np.maximum.at(farthest, row.reshape(-1), reach)
    home = np.stack(np.unravel_index(home, tuple(table)), axis=1)
    found = np.zeros(tuple(table), np.float32)
    steps = np.ceil((width + farthest) / SIDE).astype(int)
    for step in np.unique(steps):
        span = np.arange(-step - 1, step + 2)
        offset = np.stack(np.meshgrid(span, span, span, indexing="ij"), axis=-1).reshape(-1, 3)
        offset = offset[np.linalg.norm(np.maximum(np.abs(offset) - 1, 0), axis=1) <= step]
        chosen = np.flatnonzero(steps == step)
        for some in np.array_split(chosen, max(1, len(chosen) * len(offset) // (64 * _PIECE))):
            there = home[some, None] + offset
            fits = ((there >= 0) & (there < table)).all(axis=2)
            at = np.ravel_multi_index(tuple(there[fits].T), tuple(table))
            np.maximum.at(found.reshape(-1), at, np.repeat(farthest[some].astype(np.float32), fits.sum(axis=1)))
    block = np.flatnonzero(found)
    return block, found.flat[block]


def middles_of(grid: Grid, corner: np.ndarray, side: int) -> np.ndarray:
    """Positions of the middles of groups of `side`^3 nodes with lowest nodes (g,3) int, (g,3) float64; their nodes are
    up to (side - 1) * HALF cells off."""
    return grid.origin + grid.spacing * (corner + 0.5 * (side - 1))
