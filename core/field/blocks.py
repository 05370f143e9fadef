"""Arrays over the nodes of a grid that hold values near a surface only, in blocks of 8^3 nodes.

A block is a leaf of OpenVDB's tree (K. Museth, ACM TOG 32(3), 2013). Above the blocks there is one plain table, which
has a 512th of the grid's entries: 8 MiB at 1024^3.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import label

from ..parts import connected_parts

SIDE = 8
_NODES = SIDE**3
_ROWS = 4096  # blocks at a time


@dataclass(frozen=True)
class Blocks:
    """An array over the nodes of a grid, constant in most blocks; only the others are stored.

    shape  : (nx,ny,nz), nodes of the grid
    slot   : (bx,by,bz) int32, which of `stored` holds a block, -1 where it is constant; rows of `stored` are in C order
    outer  : (bx,by,bz), the constants; of a stored block what it was filled with at first
    stored : (b,8,8,8); entries past the grid's last nodes mean nothing
    """

    shape: tuple[int, int, int]
    slot: np.ndarray
    outer: np.ndarray
    stored: np.ndarray

    @property
    def size(self) -> int:
        """Values stored."""
        return self.stored.size

    def at(self, node: np.ndarray) -> np.ndarray:
        """Values at nodes given by their index in the flattened (C order) grid, any shape of int64."""
        block, within = _split(node, self.shape, self.slot.shape)
        slot, constant = self.slot.reshape(-1)[block].astype(np.int64), self.outer.reshape(-1)[block]
        if not len(self.stored):
            return constant
        return np.where(slot >= 0, self.stored.reshape(-1)[_NODES * slot + within], constant)

    def map(self, function: Callable, *others: "Blocks") -> "Blocks":
        """`function` of the values here and of those of `others`, which store the same blocks."""
        stored, outer = (function(*(getattr(b, name) for b in (self, *others))) for name in ("stored", "outer"))
        return replace(self, stored=stored, outer=outer)

    def corners(self) -> np.ndarray:
        """(b,3) int64, indices (i,j,k) of the lowest node of each stored block."""
        return SIDE * np.stack(np.nonzero(self.slot >= 0), axis=1)

    def inside(self, margin: int = 0) -> np.ndarray:
        """(b,8,8,8) bool, which stored entries are nodes of the grid, and at least `margin` nodes off its sides."""
        at = self.corners()[:, :, None] + np.arange(SIDE)
        fits = (at >= margin) & (at < np.array(self.shape)[:, None] - margin)
        return fits[:, 0, :, None, None] & fits[:, 1, None, :, None] & fits[:, 2, None, None, :]

    def at_sides(self, rows: slice) -> list[np.ndarray]:
        """Which entries of some stored blocks are at the sides of the box along each axis: bool arrays that broadcast
        to (s,8,8,8)."""
        at = self.corners()[rows, :, None] + np.arange(SIDE)
        side = (at == 0) | (at == np.array(self.shape)[:, None] - 1)
        return [side[:, 0, :, None, None], side[:, 1, None, :, None], side[:, 2, None, None, :]]

    def nodes(self, chosen: np.ndarray) -> np.ndarray:
        """Flat indices, ascending, of the stored nodes marked in `chosen`, (b,8,8,8) bool, false outside the box."""
        entry = np.flatnonzero(chosen)
        at = np.stack(np.unravel_index(entry % _NODES, (SIDE,) * 3), axis=1)
        at += self.corners()[entry // _NODES]
        return np.sort(np.ravel_multi_index(tuple(at.T), self.shape))

    def put(self, node: np.ndarray, values: np.ndarray) -> None:
        """Set values at nodes (flat indices), one or one each, in place; blocks that are not stored stay so."""
        block, within = _split(node, self.shape, self.slot.shape)
        slot = self.slot.reshape(-1)[block].astype(np.int64)
        held = slot >= 0
        self.stored.reshape(-1)[_NODES * slot[held] + within[held]] = np.broadcast_to(values, node.shape)[held]

    def dense(self) -> np.ndarray:
        """The whole array, (nx,ny,nz)."""
        whole = self.outer
        for axis in range(3):
            whole = np.repeat(whole, SIDE, axis=axis)
        for (i, j, k), values in zip(self.corners(), self.stored, strict=True):
            whole[i : i + SIDE, j : j + SIDE, k : k + SIDE] = values
        return whole[: self.shape[0], : self.shape[1], : self.shape[2]]

    def merged(self) -> "Blocks":
        """The same array; blocks of one value throughout are no longer stored."""
        varied = (self.stored != self.stored[:, :1, :1, :1]).any(axis=(1, 2, 3))
        slot, outer = np.full_like(self.slot, -1), self.outer.copy()
        held = self.slot >= 0
        outer[held] = np.where(varied, outer[held], self.stored[:, 0, 0, 0])
        slot[held] = np.where(varied, np.cumsum(varied) - 1, -1)
        return replace(self, slot=slot, outer=outer, stored=self.stored[varied])

    def padded(self):
        """Stored blocks with the nodes beside them, a bounded number at a time: yields a slice of the blocks and their
        values (s,10,10,10); past the grid's sides the value at the side goes on."""
        corners = self.corners()
        beside = np.arange(-1, SIDE + 1)
        high = np.array(self.shape) - 1
        for first in range(0, len(corners), _ROWS):
            rows = slice(first, first + _ROWS)
            x, y, z = np.moveaxis(np.clip(corners[rows, :, None] + beside, 0, high[:, None]), 1, 0)
            node = (x[:, :, None, None] * self.shape[1] + y[:, None, :, None]) * self.shape[2] + z[:, None, None, :]
            yield rows, self.at(node)


def blocks_of(shape: tuple[int, int, int], block: np.ndarray, outer) -> Blocks:
    """Blocks of a grid of `shape` nodes, those whose flat indices `block` (b,) ascend stored; all values `outer`, a
    NumPy scalar."""
    table = table_shape(shape)
    slot = np.full(table, -1, np.int32)
    slot.flat[block] = np.arange(len(block), dtype=np.int32)
    return Blocks(shape, slot, np.full(table, outer), np.full((len(block),) + (SIDE,) * 3, outer))


def table_shape(shape) -> tuple[int, int, int]:
    """Blocks along each axis of a grid of `shape` nodes."""
    return tuple(-(-n // SIDE) for n in shape)


def block_corners(array: "np.ndarray | Blocks") -> np.ndarray:
    """(b,3) int64, indices (i,j,k) of the lowest node of each block that is stored, of an array of all."""
    if isinstance(array, Blocks):
        return array.corners()
    return SIDE * np.indices(table_shape(array.shape)).reshape(3, -1).T


def node_gradient(values: "np.ndarray | Blocks", spacing: float) -> "np.ndarray | Blocks":
    """Central differences of float32 values at every node, the last axis x, y, z; one-sided at the sides of the box. In
    Blocks zero at nodes with a neighbour that has the value of a constant block or more."""
    if isinstance(values, np.ndarray):
        return np.stack(np.gradient(values, np.float32(spacing)), axis=-1)
    slopes = np.empty((*values.stored.shape, 3), np.float32)
    middle = (slice(None), *(slice(1, -1),) * 3)
    limit, inside = np.abs(values.outer).max(), values.inside()
    for rows, around in values.padded():
        known = np.ones(around[middle].shape, bool)
        for axis, at_side in zip((1, 2, 3), values.at_sides(rows), strict=True):
            slope = np.gradient(around, np.float32(spacing), axis=axis)[middle]
            slopes[rows, ..., axis - 1] = np.where(at_side, 2 * slope, slope)  # half of it is to the same value again
            for shift in (-1, 1):
                known &= np.abs(np.roll(around, shift, axis=axis)[middle]) < limit
        slopes[rows][~(known & inside[rows])] = 0
    return replace(values, stored=slopes, outer=np.zeros(values.slot.shape, np.float32))


def marked_nodes(mask: "np.ndarray | Blocks") -> np.ndarray:
    """Flat indices, ascending, of the nodes that are stored and marked."""
    return np.flatnonzero(mask) if isinstance(mask, np.ndarray) else mask.nodes(mask.stored & mask.inside())


def each(function: Callable, *arrays):
    """`function` of arrays, or of :class:`Blocks` that store the same blocks."""
    first, *others = arrays
    return function(*arrays) if isinstance(first, np.ndarray) else first.map(function, *others)


def at_nodes(array: "np.ndarray | Blocks", node: np.ndarray) -> np.ndarray:
    """Values at nodes given by their flat index."""
    return array.reshape(-1)[node] if isinstance(array, np.ndarray) else array.at(node)


def inner_nodes(array: "np.ndarray | Blocks") -> "np.ndarray | Blocks":
    """Whether nodes are off the sides of the box, of those that `array` stores; false elsewhere."""
    if isinstance(array, np.ndarray):
        inner = np.zeros(array.shape, bool)
        inner[(slice(1, -1),) * array.ndim] = True
        return inner
    return replace(array, stored=array.inside(1), outer=np.zeros(array.slot.shape, bool))


def put(array: "np.ndarray | Blocks", node: np.ndarray, values: np.ndarray) -> None:
    """Set values at nodes given by their flat index, in place; in Blocks at those that are stored."""
    if isinstance(array, np.ndarray):
        array.reshape(-1)[node] = values
    else:
        array.put(node, values)


def counts(labels: "np.ndarray | Blocks") -> np.ndarray:
    """How many nodes have each label; constant blocks count as whole ones."""
    if isinstance(labels, np.ndarray):
        return np.bincount(labels.reshape(-1))
    size = int(max(labels.stored.max(initial=0), labels.outer.max())) + 1
    within = np.bincount(labels.stored.reshape(-1), minlength=size)
    return within + _NODES * np.bincount(labels.outer.reshape(-1), minlength=size)


def regions(mask: "np.ndarray | Blocks") -> tuple["np.ndarray | Blocks", int]:
    """Connected sets of marked nodes, by shared faces: labels from 1, 0 where `mask` is false, and how many there are.

    In blocks: sets within each block, then joined where they meet at faces, and with constant blocks. Exact, and no
    larger than what is stored.
    """
    if isinstance(mask, np.ndarray):
        return label(mask)
    count = len(mask.stored)
    apart = np.zeros((count, SIDE + 1, SIDE, SIDE), bool)  # with a gap after each block
    apart[:, :SIDE] = mask.stored & mask.inside()
    within, sets = label(apart.reshape(-1, SIDE, SIDE))
    del apart
    within = within.reshape(count, SIDE + 1, SIDE, SIDE)[:, :SIDE]
    outer, more = label(mask.outer & (mask.slot < 0))
    outer[outer > 0] += sets
    links = np.concatenate([_meeting(mask.slot, within, outer, axis) for axis in range(3)], axis=1)
    names = connected_parts(*links, sets + more + 1)  # label 0 stays alone, hence 0
    return replace(mask, stored=names[within], outer=names[outer]), int(names.max())


def _meeting(slot, within, outer, axis):
    """Pairs of labels, (2,p), that share a face between two blocks along `axis`."""
    slot, outer = np.moveaxis(slot, axis, 0), np.moveaxis(outer, axis, 0)
    first, last = np.take(within, 0, axis=axis + 1), np.take(within, SIDE - 1, axis=axis + 1)
    lower, upper = slot[:-1], slot[1:]
    both, below, above = (lower >= 0) & (upper >= 0), (lower >= 0) & (upper < 0), (lower < 0) & (upper >= 0)

    def to_constant(plane, constant):
        return plane.reshape(-1), np.repeat(constant, SIDE * SIDE)

    pairs = [
        np.stack([last[lower[both]].reshape(-1), first[upper[both]].reshape(-1)]),
        np.stack(to_constant(last[lower[below]], outer[1:][below])),
        np.stack(to_constant(first[upper[above]], outer[:-1][above])),
    ]
    pairs = np.concatenate(pairs, axis=1).astype(np.int64)
    base = int(pairs.max(initial=0)) + 1
    keys = np.unique(pairs[0] * base + pairs[1])
    pairs = np.stack([keys // base, keys % base])
    return pairs[:, (pairs > 0).all(axis=0)]


def _split(node, shape, table):
    """Flat index of the block and of the entry within it, for nodes by their flat index."""
    rest, k = np.divmod(node, shape[2])
    i, j = np.divmod(rest, shape[1])
    block = ((i // SIDE) * table[1] + j // SIDE) * table[2] + k // SIDE
    return block, ((i % SIDE) * SIDE + j % SIDE) * SIDE + k % SIDE
