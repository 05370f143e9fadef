"""Steps from the surface to the nodes next to it: there not only the distance is known but also the way."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..lookup import rows_of
from ..parallel import work_through
from .grid import node_strides

_TOWARDS = 0.5  # cells, by which the steps of two neighbouring nodes may point at each other


@dataclass(frozen=True)
class NodeSet:
    """Some nodes of a grid. They are called by their rows, from 0 to b - 1.

    shape : (nx,ny,nz), nodes of the grid     node : (b,) int64, flat index in the grid, ascending
    """

    shape: tuple[int, int, int]
    node: np.ndarray

    @cached_property
    def ahead(self) -> np.ndarray:
        """(3,b+1) int64: the row of the next node along each axis, -1 where that is not in the set or past the side of
        the box. The last column is -1, so that steps may follow each other."""
        found, strides = np.full((3, len(self.node) + 1), -1), node_strides(self.shape)

        def look(axis):
            row = rows_of(self.node + strides[axis], self.node)
            found[axis, :-1] = np.where(self.node // strides[axis] % self.shape[axis] < self.shape[axis] - 1, row, -1)

        work_through(look, range(3))
        return found

    @cached_property
    def behind(self) -> np.ndarray:
        """(3,b+1) int64: the same the other way along each axis."""
        found = np.full_like(self.ahead, -1)
        for axis, row in enumerate(found):
            low, high = self.edges(axis)
            row[high] = low
        return found

    def edges(self, axis: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the lower and the higher ends of the grid edges along `axis` with both ends in the set, (e,) each,
        the lower ones ascending."""
        high = self.ahead[axis, :-1]
        low = np.flatnonzero(high >= 0)
        return low, high[low]


@dataclass(frozen=True)
class NearBand(NodeSet):
    """The nodes within two cells of the surface.

    step     : (b,3) float64, from the foot point to the node
    past_rim : (b,) bool, whether the foot point lies on a rim of the sheet, where `step` is no normal
    sample   : (b,) int32, the sample nearest to the node
    nearer   : rows (c,) of nodes that have a foot clearly closer than that, between patches that do not quite meet, and
               the steps from those (c,3) float64; None where nobody looked
    """

    step: np.ndarray
    past_rim: np.ndarray
    sample: np.ndarray
    nearer: tuple[np.ndarray, np.ndarray] | None = None

    def from_nearer(self) -> "NearBand":
        """The same with the steps from the closer feet, which are as long as the distances. Meshes do without: such
        steps turn from node to node, and the single layer of the tests' bust has a hole more by them."""
        if self.nearer is None:
            return self
        row, step = self.nearer
        steps = self.step.copy()
        steps[row] = step
        return replace(self, step=steps, nearer=None)

    def whole_cells(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of the cells whose lowest nodes have these rows (m,), or -1, those with all eight corners in the band: their
        numbers (c,), ascending, and the rows of the corners in the order of :data:`.grid.CORNERS`, (8,c)."""
        whole, corner = np.arange(len(row)), row[None]
        for ahead in self.ahead[::-1]:
            further = ahead[corner]
            known = np.flatnonzero((further >= 0).all(axis=0))
            whole, corner = whole[known], np.concatenate([each.take(known, axis=1) for each in (corner, further)])
        return whole, corner

    def between(self, cells: np.ndarray, spacing: float, off_rims: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Steps from the surface to places between the nodes, at those of the positions `cells` (m,3), in cells and
        inside the grid, whose eight corners lie in the band: their rows (r,) and the steps there (r,3) float64. With
        `off_rims`, no corner's step is one past a rim.

        An unsigned distance has a kink on the surface, where a trilinear reading of the nodes' values gives a third of
        a cell instead of zero. The step from the foot point, the gradient of u^2 / 2, has none (Ambrosio and
        Mantegazza, J. Geom. Anal. 8, 1998): it is read trilinearly, and its length is the distance.

        Midway between two sheets it is the step that jumps, from one foot point to the other, and its mean would be a
        sheet that is not there. Steps of neighbouring nodes point at each other there; such cells are left out.
        """
        lowest = np.clip(np.floor(cells).astype(np.int64), 0, np.array(self.shape) - 2)
        chosen, row = self.whole_cells(rows_of(lowest @ node_strides(self.shape), self.node))
        if off_rims:
            clear = ~self.past_rim[row].any(axis=0)
            chosen, row = chosen[clear], row[:, clear]
        corner = np.stack([self.step[:, axis].take(row) for axis in range(3)]).reshape(3, 2, 2, 2, -1)
        apart = [np.diff(corner[axis], axis=axis).min(axis=(0, 1, 2)) for axis in range(3)]
        divergent = np.flatnonzero(np.min(apart, axis=0) >= -_TOWARDS * spacing)
        chosen, blend = chosen[divergent], corner[..., divergent]
        for share in (cells[chosen] - lowest[chosen]).T:
            blend = (1 - share) * blend[:, 0] + share * blend[:, 1]
        return chosen, blend.T
