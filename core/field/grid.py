"""The regular grid that carries the field."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError, SettingsError
from ..given_arrays import finite_points

CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T  # of a cell, as steps from its lowest node
ADJACENT = 1.8  # cells, between the middles of edges of the grid that are next to each other
PADDING = 0.125  # of the object's longest side, on every side


@dataclass(frozen=True)
class Grid:
    """Nodes ``origin + spacing * (i,j,k)``, 0 <= (i,j,k) < shape."""

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


def padding_cells(resolution: int) -> float:
    """Cells that the padding is wide, of a grid with `resolution` cells along its longest side."""
    return resolution * PADDING / (1 + 2 * PADDING)


def node_strides(shape: tuple[int, int, int]) -> np.ndarray:
    """Steps of the flat index of nodes along the three axes, (3,) int64."""
    return np.array([shape[1] * shape[2], shape[2], 1])


def fit_grid(points: np.ndarray, resolution: int) -> Grid:
    """A grid of cubic cells on the points' bounding box, padded by PADDING on every side: `resolution` cells along the
    longest side, as many as needed along the others. Raises :class:`InputError` for anything but points (n,3), n >= 1,
    that are finite and not all in one place, :class:`SettingsError` for less than one cell."""
    points = finite_points(points, least=1)
    low, high = points.min(axis=0), points.max(axis=0)
    if not 0 < (high - low).max() < np.inf:
        raise InputError(f"the points reach from {low} to {high}; a grid needs points that are not all in one place")
    if not resolution >= 1:
        raise SettingsError(f"resolution is {resolution}; a grid needs at least 1 cell")
    padding = PADDING * (high - low).max()
    sides = high - low + 2 * padding
    spacing = float(sides.max() / resolution)
    cells = np.ceil(sides / spacing - 1e-9).astype(int)
    origin = low - padding - 0.5 * (cells * spacing - sides)
    return Grid(origin, spacing, tuple(int(c) + 1 for c in cells))
