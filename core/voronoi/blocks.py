"""Blocks of points that can be worked on one by one, each with all the others that matter to it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..progress import Progress

SIZE = 2000  # points that a block owns, at most, where it has not too many others to heed

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
    themselves in the same way.
    """
    cloud = _Cloud(points, reach, KDTree(points), Progress.of(progress))
    blocks, left = [], np.arange(len(points))
    while len(left):
        found = cloud.split(left) or [cloud.block(left)]
        blocks += found
        left = np.setdiff1d(left, np.concatenate([block.own for block in found]))
        cloud.progress(1 - len(left) / len(points))
    return blocks


@dataclass(frozen=True)
class _Cloud:
    points: np.ndarray
    reach: np.ndarray
    tree: KDTree
    progress: Progress

    def split(self, rows: np.ndarray) -> list[Block] | None:
        """Blocks that own these points or, where some look too far, most of them; None where they are crowded."""
        if len(rows) > SIZE:
            x = self.points[rows]
            order = np.argpartition(x[:, np.ptp(x, axis=0).argmax()], len(rows) // 2)
            halves = [self.split(half) for half in np.array_split(rows[order], 2)]
            if None not in halves:
                return halves[0] + halves[1]
        self.progress(0.0)
        block = self.block(np.sort(rows[self.reach[rows] <= _WIDE * np.median(self.reach[rows])]))
        return [block] if len(block.members) < _CROWDED * len(block.own) else None

    def block(self, own: np.ndarray) -> Block:
        """A point lies in one of the balls around the own ones exactly where, in a fourth dimension, it is no farther
        than the largest radius from one of them raised by sqrt(largest^2 - radius^2)."""
        points, reach = self.points[own], self.reach[own]
        low, high, largest = points.min(axis=0), points.max(axis=0), _SLACK * reach.max()
        cube = 0.5 * (high - low).max() + largest
        near = np.array(self.tree.query_ball_point(0.5 * (low + high), cube, p=np.inf, return_sorted=True))
        x = self.points[near]
        boxed = ((x >= low - largest) & (x <= high + largest)).all(axis=1)
        near, x = near[boxed], x[boxed]
        raised = KDTree(np.column_stack([points, np.sqrt(largest**2 - reach**2)]))
        distance, _ = raised.query(np.column_stack([x, np.zeros(len(x))]), distance_upper_bound=_SLACK * largest)
        return Block(own, near[np.isfinite(distance)])
