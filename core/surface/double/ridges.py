"""Gaps between sheets that run close, kept open wherever they are wide enough for an iso-surface.

Midway between two sheets the distance has a ridge, and nodes on either side of it lie up to half a cell lower. So in a
gap hardly wider than two levels an iso-surface goes on in places and stops in others, as the nodes happen to lie, and
narrow wedges are closed a cell too early. Where the steps to two neighbouring nodes point at each other they tell how
high the ridge is.
"""

import numpy as np
from scipy.spatial import KDTree

from ...field.blocks import Blocks, at_nodes, put
from ...field.grid import Grid
from ...field.steps import NearBand
from ...linalg import dots, unit
from ...parallel import in_order
from ...parts import near_parts

_DIAGONAL = np.sqrt(2)  # cells: iso-surfaces may join nodes as far apart, at opposite corners of a face
_FACING = -0.5  # largest cosine between the steps to both: wedges wider than 60 degrees need no help
_FEW, _AROUND = 9, 2.0  # nodes, cells: ridges this close are taken to be as high as they are on average
_NEXT, _LEAST = 1.5, 12  # cells, nodes: a ridge of fewer is over a crack in one sheet
_OWN = 0.75  # of the height that a ridge must have, at a node itself: it is lower where a sheet has a crack


def raise_ridges(values: np.ndarray | Blocks, band: NearBand, grid: Grid, level: float) -> None:
    """Give both ends of grid edges that cross a ridge of the distance its height, in place, where an iso-surface at
    `level` then opens the gap and leaves the sheets whole.

    That is where no two nodes lie across the diagonal of a face from each other that the iso-surface must not join: a
    raised one and one behind its sheet, above the level as well; two that stay below it, on either sheet.

    values : (nx,ny,nz) float32 or Blocks, distances at the nodes     level : float; both in the units of the samples
    """
    away = at_nodes(values, band.node).astype(np.float64)
    toward = _directions(band)
    height, edges = np.zeros(len(away)), [(axis, *band.edges(axis)) for axis in range(3)]
    for _, (ends, found) in in_order(lambda each: _ridges(*each, away, toward, grid.spacing), edges):
        for end in ends:
            np.maximum.at(height, end, found)
    row = np.flatnonzero(height)
    ridge = near_parts(grid.positions(band.node[row]), _NEXT * grid.spacing)
    row = row[np.bincount(ridge)[ridge] >= _LEAST]
    own, typical = height[row], _averaged(height[row], grid.positions(band.node[row]), _AROUND * grid.spacing)
    off = _DIAGONAL * grid.spacing - level
    least = max(level, off + 0.5 * _DIAGONAL * grid.spacing)
    raised = (typical > np.maximum(least, away[row])) & (own > _OWN * least) & (away[row] > off)
    put(values, band.node[row[raised]], typical[raised].astype(np.float32))


def ridge_share(band: NearBand) -> float:
    """How many grid edges of the band cross a ridge, for each of its nodes: where sheets run up to twice its width
    apart, or turn within it."""
    toward = _directions(band)
    return sum(len(_facing(axis, *band.edges(axis), toward)[0]) for axis in range(3)) / max(len(band.node), 1)


def _directions(band):
    """Unit directions from the surface to the nodes of the band, (3,b)."""
    return unit(band.step).T


def _averaged(height, place, reach):
    """Heights (m,) at places (m,3), averaged over the nearest few within reach: where those of single nodes decide,
    pillars are left in the gap."""
    if not len(height):
        return height
    away, near = KDTree(place).query(place, k=_FEW, distance_upper_bound=reach, workers=-1)
    return np.mean(height.take(near, mode="clip"), axis=1, where=np.isfinite(away))


def _ridges(axis, low, high, away, toward, cell):
    """Of grid edges along `axis` between rows `low` and `high` of the band, those with a ridge between, as rows of both
    ends (2,e), and its height (e,): where the planes through both feet are equally far."""
    low, high = _facing(axis, low, high, toward)
    rise, fall = toward[axis, low], -toward[axis, high]
    along = np.clip((away[high] - away[low] + cell * fall) / (rise + fall), 0, cell)
    return np.stack([low, high]), away[low] + along * rise


def _facing(axis, low, high, toward):
    """Those grid edges along `axis` the steps to whose ends point at each other, as rows of both."""
    met = (toward[axis, low] > 0) & (toward[axis, high] < 0)
    low, high = low[met], high[met]
    facing = dots(toward[:, low], toward[:, high]) < _FACING
    return low[facing], high[facing]
