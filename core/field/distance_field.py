"""A distance field on a regular grid, the way users hold it."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates


@dataclass(frozen=True)
class DistanceField:
    """Distances at the nodes of a regular grid, in input units.

    values  : (nx,ny,nz) float32, node (i,j,k) lies at ``origin + spacing * (i,j,k)``
    origin  : (3,) float64
    spacing : float, one cell
    band    : float, half width of the band that holds values (input units); inf where the whole box does
    sdf     : True when the values are signed (negative inside)
    """

    values: np.ndarray
    origin: np.ndarray
    spacing: float
    band: float = np.inf
    sdf: bool = False

    def sample(self, x) -> np.ndarray:
        """Distance at points `x`, (m,3) -> (m,) float64: trilinear inside the box; outside it, the value at the
        nearest point of the box plus the distance to that point."""
        inside, outside = self._split(x)
        values = map_coordinates(self.values, inside.T, order=1, mode="nearest", output=np.float64)
        return values + self.spacing * np.linalg.norm(outside, axis=1)

    def gradient(self, x) -> np.ndarray:
        """Unit-free gradient of :meth:`sample` at `x`, (m,3) -> (m,3) float64, central differences of half a cell."""
        x = np.asarray(x, np.float64)
        step = 0.5 * self.spacing
        slopes = [(self.sample(x + e) - self.sample(x - e)) / (2 * step) for e in step * np.eye(3)]
        return np.stack(slopes, axis=1)

    def _split(self, x):
        """Grid coordinates of the nearest point inside the box, and what is left over, both (m,3) in cells."""
        cells = (np.asarray(x, np.float64) - self.origin) / self.spacing
        inside = np.clip(cells, 0, np.array(self.values.shape) - 1)
        return inside, cells - inside
