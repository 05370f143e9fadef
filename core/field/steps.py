"""Steps from the surface to the nodes next to it: there not only the distance is known but also the way."""

from dataclasses import dataclass

import numpy as np

from ..lookup import rows_of
from .grid import CORNERS, node_strides

_TOWARDS = 0.5  # cells, by which the steps of two neighbouring nodes may point at each other


@dataclass(frozen=True)
class NearBand:
    """The nodes within two cells of the surface.

    node     : (b,) int64, flat index in the grid, ascending     step : (b,3) float64, from the foot point to the node
    past_rim : (b,) bool, whether the foot point lies on a rim of the sheet, where `step` is no normal
    """

    node: np.ndarray
    step: np.ndarray
    past_rim: np.ndarray

    def rows(self, node: np.ndarray) -> np.ndarray:
        """Where nodes (m,) stand in the band, -1 for those that do not."""
        return rows_of(node, self.node)

    def edges(self, axis: int, shape: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
        """Where the lower and the higher ends of the edges along `axis` of a grid of `shape` stand in the band, (e,)
        int64 each, of those with both ends in it."""
        stride = node_strides(shape)[axis]
        row = self.rows(self.node + stride)
        low = np.flatnonzero((row >= 0) & (self.node // stride % shape[axis] < shape[axis] - 1))
        return low, row[low]

    def between(
        self, cells: np.ndarray, shape: tuple[int, int, int], spacing: float, off_rims: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Steps from the surface to places between the nodes of a grid of `shape`, at those of the positions `cells`
        (m,3), in cells and inside the grid, whose eight corners lie in the band: their rows (r,) and the steps there
        (r,3) float64. With `off_rims`, no corner's step is one past a rim.

        An unsigned distance has a kink on the surface, where a trilinear reading of the nodes' values gives a third of
        a cell instead of zero. The step from the foot point, the gradient of u^2 / 2, has none (Ambrosio and
        Mantegazza, J. Geom. Anal. 8, 1998): it is read trilinearly, and its length is the distance.

        Midway between two sheets it is the step that jumps, from one foot point to the other, and its mean would be a
        sheet that is not there. Steps of neighbouring nodes point at each other there; such cells are left out.
        """
        lowest = np.clip(np.floor(cells).astype(np.int64), 0, np.array(shape) - 2)
        strides = node_strides(shape)
        row = self.rows((lowest @ strides)[:, None] + CORNERS @ strides)
        chosen = np.flatnonzero((row >= 0).all(axis=1))
        if off_rims:
            chosen = chosen[~self.past_rim[row[chosen]].any(axis=1)]
        corner = self.step[row[chosen]].reshape(-1, 2, 2, 2, 3)
        apart = [np.diff(corner[..., axis], axis=1 + axis).reshape(len(chosen), 4) for axis in range(3)]
        divergent = np.min(apart, axis=(0, 2)) >= -_TOWARDS * spacing
        chosen, blend = chosen[divergent], corner[divergent]
        for share in (cells[chosen] - lowest[chosen]).T:
            share = share.reshape(-1, *[1] * (blend.ndim - 2))
            blend = (1 - share) * blend[:, 0] + share * blend[:, 1]
        return chosen, blend
