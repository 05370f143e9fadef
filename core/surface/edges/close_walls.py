"""Sheets that run side by side within two cells or three, told by the steps to the nodes of the grid.

Where samples lie far closer together than nodes, the neighbourhood of a sample ends before the sheet behind it. There a
cell may hold both sheets, and its corners go with one or the other: a node inside of a wall and one past it see the
surface on the same side, though the edge between them crosses it.
"""

import numpy as np
from scipy.spatial import KDTree

from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...linalg import dots
from .sheets import SIDE_BY_SIDE

_NEAR = 1.0  # cells, from a sheet to the nodes that tell
_APART = 0.5  # cells, between the planes of two such sheets, at least; those of one bent sheet are closer
_DENSE = 0.75  # cells, local spacing up to which the nearest samples may all lie on one of them
_AROUND = 1.0  # cells, samples this close to one count as well


def beside_within_cells(band: NearBand, surface: LocalSurface, grid: Grid) -> np.ndarray:
    """Which samples are on sheets with another one side by side, (n,) bool. Grid edges tell them, both ends of which
    have their feet off the rims, on parallel planes half a cell apart or more: the samples of these ends, and all
    within a cell of such a sample."""
    dense = surface.spacing <= _DENSE * grid.spacing
    if not dense.any():
        return dense
    step, ends = np.ascontiguousarray(band.step.T), []
    away = np.maximum(np.sqrt(dots(step, step)), np.finfo(float).tiny)
    usable = ~band.past_rim & (away <= _NEAR * grid.spacing) & dense[band.sample]
    for axis in range(3):
        edge = np.stack(band.edges(axis))
        low, high = edge = edge[:, usable[edge].all(axis=0)]
        between = step[:, low] - step[:, high]
        between[axis] += grid.spacing
        parallel = np.abs(dots(step[:, low], step[:, high])) > SIDE_BY_SIDE * away[low] * away[high]
        apart = [np.abs(dots(between, step[:, end])) > _APART * grid.spacing * away[end] for end in (low, high)]
        ends.append(edge[:, parallel & apart[0] & apart[1]])
    at = np.unique(band.sample[np.concatenate(ends, axis=None)])
    if not len(at):
        return np.zeros(len(dense), bool)
    reach = _AROUND * grid.spacing
    return KDTree(surface.points[at]).query(surface.points, distance_upper_bound=reach, workers=-1)[0] <= reach
