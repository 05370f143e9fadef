"""A distance field on a regular grid, the way users hold it: in the whole box, or in a band along the surface."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from ..errors import VADError
from ..given_arrays import finite_points
from ..linalg import row_dots
from .blocks import Blocks
from .feet import Feet
from .grid import CORNERS
from .steps import NearBand

_WHOLE = 1 << 27  # nodes, the most that a band's values are laid out in the whole box for
_CHUNK = 1 << 17  # queries
_WITHIN = 1 - 1e-6  # of the band, up to where values are distances


class _OnGrid:
    """What both kinds of field share. Node (i,j,k) lies at ``origin + spacing * (i,j,k)``."""

    def sample(self, x) -> np.ndarray:
        """Distance at points `x`, (m,3) -> (m,) float64: trilinear where there are values, next to the surface of an
        unsigned field by the steps `near` (see :meth:`NearBand.between`); outside the box, the value at the nearest
        point of the box plus the distance to that point. Raises :class:`InputError` for anything but finite points."""
        cells = (finite_points(x) - self.origin) / self.spacing
        inside = np.clip(cells, 0, np.array(self.shape) - 1)
        found = self._inside(inside)
        if self.near is not None and not self.sdf:
            row, step = self.near.between(inside, self.spacing)
            found[row] = np.sqrt(row_dots(step, step))
        return found + self.spacing * np.hypot.reduce(cells - inside, axis=1)

    def gradient(self, x) -> np.ndarray:
        """Unit-free gradient of :meth:`sample` at `x`, (m,3) -> (m,3) float64, central differences of half a cell."""
        x, step = finite_points(x), 0.5 * self.spacing
        slopes = [(self.sample(x + e) - self.sample(x - e)) / (2 * step) for e in step * np.eye(3)]
        return np.stack(slopes, axis=1)


@dataclass(frozen=True, eq=False)
class DistanceField(_OnGrid):
    """Distances at the nodes of a regular grid, in input units.

    values  : (nx,ny,nz) float32, node (i,j,k) lies at ``origin + spacing * (i,j,k)``
    origin  : (3,) float64
    spacing : float, one cell
    band    : float, half width of the band that holds values (input units); inf where the whole box does
    sdf     : True when the values are signed (negative inside)
    near    : NearBand in input units, the nodes next to the surface and the steps to them, or None
    """

    values: np.ndarray
    origin: np.ndarray
    spacing: float
    band: float = np.inf
    sdf: bool = False
    near: NearBand | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along each axis."""
        return self.values.shape

    def _inside(self, cells):
        return map_coordinates(self.values, cells.T, order=1, mode="nearest", output=np.float64)


@dataclass(frozen=True, eq=False)
class BandedField(_OnGrid):
    """Distances at the nodes near the surface alone, in input units; beyond them, those to the surface's foot points.

    :meth:`sample` and :meth:`gradient` work as those of a :class:`DistanceField`, in and out of the band, and beyond it
    are slower.

    blocks  : Blocks of float32; the band's half width, negative inside, where no value is closer to the surface
    origin  : (3,) float64     spacing : float, one cell     band : float, half width of the band, input units
    sdf     : True when the values are signed (negative inside)
    feet    : Feet in cells from the origin
    near    : NearBand in input units, the nodes next to the surface and the steps to them, or None
    """

    blocks: Blocks
    origin: np.ndarray
    spacing: float
    band: float
    sdf: bool
    feet: Feet
    near: NearBand | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes of the whole box along each axis."""
        return self.blocks.shape

    @property
    def values(self) -> np.ndarray:
        """(nx,ny,nz) float32, made anew each time: the values in the whole box, the band's half width beyond it.

        Raises :class:`VADError` for more than 2^27 nodes (512 MiB).
        """
        nodes = int(np.prod(self.shape))
        if nodes > _WHOLE:
            raise VADError(
                f"the whole box has {nodes} nodes, and values are laid out for at most {_WHOLE}; use sample, gradient "
                "or the blocks of the field, or write it as OpenVDB"
            )
        return self.blocks.dense()

    def _inside(self, cells):
        found = np.empty(len(cells))
        for first in range(0, len(cells), _CHUNK):
            part = slice(first, first + _CHUNK)
            found[part] = self._in_or_out(cells[part])
        return found

    def _in_or_out(self, cells):
        """Trilinear where all eight corners lie in the band, else the distance to the feet with the corners' sign."""
        high = np.array(self.shape) - 1
        low = np.minimum(np.floor(cells).astype(np.int64), high - 1)
        share = cells - low
        weight = np.prod(np.where(CORNERS, share[:, None], 1 - share[:, None]), axis=2)
        corner = low[:, None] + CORNERS
        values = self.blocks.at(np.ravel_multi_index(tuple(np.moveaxis(corner, 2, 0)), self.shape)).astype(np.float64)
        found = row_dots(weight, values)
        out = np.flatnonzero((np.abs(values) >= _WITHIN * self.band).any(axis=1))
        if len(out):
            inside = found[out] < 0
            found[out] = np.where(inside, -1, 1) * self.spacing * self.feet.nearest(cells[out])[0]
        return found
