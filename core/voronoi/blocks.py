"""Blocks of points that can be worked on one by one, each with all the others that matter to it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..lookup import is_among
from ..parallel import in_order
from ..progress import Progress

SIZE = 2500  # points that a block owns, at most, where it has not too many others to heed

_ALONE, _LEAST = 1.25, 128  # points in a block for each that it owns, at most, to halve it, and points that it owns
_MIDDLE, _LEVEL = (0.45, 0.55), 1e-4  # points in the midst of a side, and on how much of it they are on one plane
_ASLANT = np.array([0.013, 0.0071, 0.0089])  # of no simple ratio
_CROWDED = 4.0  # points in a block, for each that it owns
_WIDE = 4.0  # median reaches of a block
_SLACK = 1 + 1e-9  # of the reach, against roundoff


@dataclass(frozen=True)
class Block:
    """own : (c,) int64, rising     members : (m,) int64, rising; the own and all points within reach of one of them"""

    own: np.ndarray
    members: np.ndarray


def overlapping_blocks(points: np.ndarray, reach: np.ndarray, progress=None) -> list[Block]:
    """Blocks that own every point once, always the same for the same input.

    points : (n,3) float64
    reach  : (n,) float64, how far from each point others matter to it, units of `points`

    The points are halved across their longest side until at most SIZE are left. Where a block would hold many more
    points than it owns, as in a cloud that fills a volume, the halves stay together. Points that look much farther than
    those around them, such as outliers, would do that to the block they are in; they are set aside and split up among
    themselves in the same way. Where halves hold hardly more points than they own, as along lines, they are halved on:
    diagrams of lines that are skew to each other have as many tetrahedra as the square of their points.
    """
    progress, cloud = Progress.of(progress), _Cloud(points, reach, KDTree(points))
    blocks, left = [], np.arange(len(points))
    while len(left):
        halved = cloud.halved(left)
        made = in_order(cloud.uncrowded, progress.part(1 - len(left) / len(points), 1.0).each(_smallest(halved)))
        found = cloud.joined(halved, (block for _, block in made)) or [cloud.block(left)]
        blocks += [part for block in found for part in cloud.parted(block)]
        left = np.setdiff1d(left, np.concatenate([block.own for block in found]))
    return blocks


def _smallest(halved):
    """The rows that were not halved further, in order."""
    rows, halves = halved
    return [rows] if not halves else [each for half in halves for each in _smallest(half)]


@dataclass(frozen=True)
class _Cloud:
    points: np.ndarray
    reach: np.ndarray
    tree: KDTree

    def halved(self, rows: np.ndarray) -> tuple:
        """These rows, and their halves across the longest side in the same form; none where there are few."""
        if len(rows) <= SIZE:
            return rows, ()
        return rows, [self.halved(half) for half in self._halves(rows)]

    def joined(self, halved: tuple, made: Iterator) -> list[Block] | None:
        """Blocks that own these points or, where some look too far, most of them, of the smallest ones `made`; None
        where they are crowded."""
        rows, halves = halved
        if halves:
            found = [self.joined(half, made) for half in halves]
            if None not in found:
                return found[0] + found[1]
        block = self.uncrowded(rows) if halves else next(made)
        return None if block is None else [block]

    def uncrowded(self, rows: np.ndarray) -> Block | None:
        """The block that owns those of these points that do not look too far; None where it is crowded."""
        block = self.block(np.sort(rows[self.reach[rows] <= _WIDE * np.median(self.reach[rows])]))
        return block if len(block.members) < _CROWDED * len(block.own) else None

    def parted(self, block: Block) -> list[Block]:
        """The block, or smaller ones that own its points and hold hardly more."""
        if len(block.own) <= _LEAST or len(block.members) > _ALONE * len(block.own):
            return [block]
        halves = [self.block(np.sort(half)) for half in self._halves(block.own)]
        if any(len(half.members) > _ALONE * len(half.own) for half in halves):
            return [block]
        return [part for half in halves for part in self.parted(half)]

    def _halves(self, rows):
        """Rows in two halves across the longest side of their points; a little aslant where a plane of them lies right
        across it, whose points would otherwise go to either half at random."""
        x = self.points[rows]
        size, ends = np.ptp(x, axis=0), (np.array(_MIDDLE) * len(rows)).astype(int)
        way = np.where(np.arange(3) == size.argmax(), 1.0, 0.0)
        if np.ptp(np.partition(x @ way, ends)[ends]) < _LEVEL * size.max():
            way = np.where(way > 0, way, _ASLANT)
        return np.array_split(rows[np.argpartition(x @ way, len(rows) // 2)], 2)

    def block(self, own: np.ndarray) -> Block:
        """A point lies in one of the balls around the own ones exactly where, in a fourth dimension, it is no farther
        than the largest radius from one of them raised by sqrt(largest^2 - radius^2)."""
        points, reach = self.points[own], self.reach[own]
        low, high, largest = points.min(axis=0), points.max(axis=0), _SLACK * reach.max()
        cube = 0.5 * (high - low).max() + largest
        near = np.array(self.tree.query_ball_point(0.5 * (low + high), cube, p=np.inf, return_sorted=True))
        x = self.points[near]
        boxed = ((x >= low - largest) & (x <= high + largest)).all(axis=1)
        others = boxed & ~is_among(near, own)
        x = x[others]
        raised = KDTree(np.column_stack([points, np.sqrt(largest**2 - reach**2)]))
        distance, _ = raised.query(np.column_stack([x, np.zeros(len(x))]), distance_upper_bound=_SLACK * largest)
        return Block(own, np.sort(np.append(own, near[others][np.isfinite(distance)])))
