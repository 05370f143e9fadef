"""Points gathered into small clusters, whose means stand for them in wide neighbourhoods."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Clusters:
    """Clusters of points (n,3): the cells of a k-d tree, halved at medians across their longest sides (J. H. Friedman,
    J. L. Bentley and R. A. Finkel, ACM TOMS 3(3), 1977)."""

    points: np.ndarray

    def means(self, size: int) -> np.ndarray:
        """Means (m,3) of clusters of at most `size` points, and at least half as many if there are."""
        order, starts = self._cells
        start = next(start for start in starts if np.diff(start, append=len(order)).max() <= size)
        return np.add.reduceat(self.points[order], start, axis=0) / np.diff(start, append=len(order))[:, None]

    @cached_property
    def _cells(self):
        """The points cell by cell, (n,) int, and where each cell starts among them, level by level."""
        order, starts = np.arange(len(self.points)), [np.zeros(1, np.int64)]
        while (count := np.diff(starts[-1], append=len(order))).max() > 1:
            inside, start = self.points[order], starts[-1]
            least = np.minimum.reduceat(inside, start, axis=0)
            width = np.maximum.reduceat(inside, start, axis=0) - least
            axis, cell = width.argmax(axis=1), np.arange(len(start))
            along = inside[np.arange(len(order)), axis.repeat(count)] - least[cell, axis].repeat(count)
            share = along / np.maximum(width[cell, axis], np.finfo(float).tiny).repeat(count)
            order = order[np.argsort(cell.repeat(count) + 0.5 * share)]
            starts.append(np.sort(np.append(start, (start + count // 2)[count > 1])))
        return order, starts
