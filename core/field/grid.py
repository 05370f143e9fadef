"""The regular grid that carries the field."""

from dataclasses import dataclass
from numbers import Real

import numpy as np

from ..errors import InputError, SettingsError
from ..given_arrays import finite_points

CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T  # of a cell, as steps from its lowest node
ADJACENT = 1.8  # cells, between the middles of edges of the grid that are next to each other
_FINEST = 2**20  # cells along the longest side, so that numbers of nodes fit 64 bits
PADDING = 0.125  # of the object's longest side, on every side


@dataclass(frozen=True)
class Grid:
    """Nodes ``origin + spacing * (i,j,k)``, 0 <= (i,j,k) < shape.

    origin : (3,) float64     spacing : float, one cell     shape : (nx,ny,nz), nodes along each axis
    """

    origin: np.ndarray
    spacing: float
    shape: tuple[int, int, int]

    def positions(self, flat_index: np.ndarray) -> np.ndarray:
        """Coordinates of nodes given by their index in the flattened (C order) array, (m,) -> (m,3) float64."""
        return self.origin + self.spacing * np.stack(np.unravel_index(flat_index, self.shape), axis=1)

    def nearest_nodes(self, x: np.ndarray) -> np.ndarray:
        """Flat index of the node nearest to each point, (m,3) -> (m,)."""
        cells = np.rint((x - self.origin) / self.spacing).astype(np.int64)
        return np.ravel_multi_index(np.clip(cells, 0, np.array(self.shape) - 1).T, self.shape)

    def check(self, points: np.ndarray, *shapes: tuple) -> None:
        """Raise :class:`InputError` where points (n,3) of a surface are not all in the box, or arrays over the nodes
        have other `shapes`."""
        low, high = self.origin, self.origin + self.spacing * (np.array(self.shape) - 1)
        if not ((points >= low) & (points <= high)).all():
            raise InputError(
                f"the grid reaches from {low} to {high}, and the surface from {points.min(axis=0)} to "
                f"{points.max(axis=0)}; give a grid that holds it, as fit_grid does of its points"
            )
        for shape in shapes:
            if shape != self.shape:
                raise InputError(
                    f"distances have shape {shape} and the grid {self.shape}; give both values and band as "
                    "distance_field found them on this grid"
                )


def padding_cells(resolution: int) -> float:
    """Cells that the padding is wide, of a grid with `resolution` cells along its longest side."""
    return resolution * PADDING / (1 + 2 * PADDING)


def node_strides(shape: tuple[int, int, int]) -> np.ndarray:
    """Steps of the flat index of nodes along the three axes, (3,) int64."""
    return np.array([shape[1] * shape[2], shape[2], 1])


def fit_grid(points: np.ndarray, resolution: int) -> Grid:
    """A grid of cubic cells on the points' bounding box, padded by PADDING on every side: `resolution` cells along the
    longest side, as many as needed along the others. Raises :class:`InputError` for anything but points (n,3), n >= 1,
    that are finite and not all in one place, :class:`SettingsError` for what is no number of cells from 1 to 2^20."""
    points = finite_points(points, least=1)
    low, high = points.min(axis=0), points.max(axis=0)
    if not 0 < (high - low).max() < np.inf:
        raise InputError(f"the points reach from {low} to {high}; a grid needs points that are not all in one place")
    if not isinstance(resolution, Real) or not 1 <= resolution <= _FINEST:
        raise SettingsError(f"resolution is {resolution!r}; a grid needs a number of cells from 1 to {_FINEST}")
    padding = PADDING * (high - low).max()
    sides = high - low + 2 * padding
    spacing = float(sides.max() / resolution)
    cells = np.ceil(sides / spacing - 1e-9).astype(int)
    origin = low - padding - 0.5 * (cells * spacing - sides)
    return Grid(origin, spacing, tuple(int(c) + 1 for c in cells))
