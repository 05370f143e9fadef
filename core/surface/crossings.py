"""Which grid edges an unsigned field's surface crosses.

The step from the foot point to a node is the gradient of u^2 / 2, which is smooth across the surface, and whose
derivative there projects onto the normal (Ambrosio and Mantegazza, J. Geom. Anal. 8, 1998). So in each cell the
principal axis of that derivative is the normal, its product with the corners' steps says on which side they are, and
the cells around a grid edge vote whether the surface crosses it.

A surface without border crosses an even number of the edges of every grid face. Where votes disagree, around creases
mostly, edges are turned over until it does (see :mod:`.mending`).

Where sheets meet or run close, their crossings are found sheet by sheet (see :mod:`.meeting_edges`); there an edge may
be crossed twice.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..field.grid import CORNERS, Grid, node_strides
from ..field.local_surface import LocalSurface
from ..field.steps import NearBand
from ..linalg import principal_axes
from ..lookup import is_among, numbered
from ..parallel import even_chunks, in_order
from ..progress import Progress
from .first_steps import first_steps
from .meeting_edges import meeting_edges
from .mending import mend

_COVERED = 0.5  # cells, a crossing this close to the surface is on it, a farther one is past its rim
_SLACK = 0.1  # cells, by which distances may jump where another sheet becomes the nearest
_HAIR = np.array([0.02, 0.014, 0.009])  # cells; nodes on the surface, as on grid-aligned walls, all take one side by it
_CHUNK = 1 << 15  # cells

_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(CORNERS[a] - CORNERS[b]).sum() == 1])
_EDGE_AXIS = np.abs(CORNERS[_EDGES[:, 1]] - CORNERS[_EDGES[:, 0]]).argmax(axis=1)


@dataclass(frozen=True)
class Crossings:
    """Grid edges that the surface crosses.

    node  : (e,) int64, flat index of the edge's lower node     axis : (e,) int64, its direction
    place : (e,3) float64, where, on the surface                cells : (c,) int64, ascending, cells near the surface
    normal : (e,3) float64, of the sheet, where sheets meet; zero elsewhere
    """

    node: np.ndarray
    axis: np.ndarray
    place: np.ndarray
    cells: np.ndarray
    normal: np.ndarray

    def cells_around(self, grid: Grid) -> np.ndarray:
        """The four cells around each edge in cyclic order, by their lowest nodes, (e,4)."""
        return _cells_around(self.node, self.axis, node_strides(grid.shape))

    @cached_property
    def changing_sides(self) -> np.ndarray:
        """Edges, as 3 * node + axis, ascending, whose ends are on two sides: crossed an odd number of times."""
        edge, count = np.unique(3 * self.node + self.axis, return_counts=True)
        return edge[count % 2 == 1]


def find_crossings(band: NearBand, surface: LocalSurface, grid: Grid, progress=None) -> Crossings:
    """Crossings of the zero set, from the nodes near it."""
    progress, strides, hair = Progress.of(progress), node_strides(grid.shape), _HAIR * grid.spacing
    meet = meeting_edges(band.node, band.step, surface, grid, strides, hair, progress.part(0.0, 0.4))
    progress(0.4)
    cells, corner = _whole_cells(band, grid)
    edge, vote, place = _vote(band, corner, grid, progress.part(0.4, 0.5))
    progress(0.5)
    alone = ~is_among(edge, meet.zone) & _may_be_covered(band, edge, place, grid)
    edge, vote, place = edge[alone], vote[alone], place[alone]
    step, _ = first_steps(place, band, surface, grid, progress.part(0.5, 0.9))
    progress(0.9)
    on = np.linalg.norm(step, axis=1) <= _COVERED * grid.spacing
    edge, place, vote = edge[on], place[on] - step[on], vote[on]
    once, twice = _once(meet)
    node, axis = np.divmod(edge, 3)
    node, axis = np.concatenate([node, meet.node[once]]), np.concatenate([axis, meet.axis[once]])
    place = np.concatenate([place, meet.place[once]])
    normal = np.concatenate([np.zeros((len(edge), 3)), meet.normal[once]])
    crossed = np.concatenate([vote > 0, meet.crossed[once]])
    certainty = np.concatenate([np.abs(vote), meet.certainty[once]])
    whole = is_among(_cells_around(node, axis, strides), cells).all(axis=1)
    node, axis, crossed, certainty = node[whole], axis[whole], crossed[whole], certainty[whole]
    progress(0.95)
    mend(node, axis, crossed, certainty, strides)
    progress(0.98)
    twice = twice[is_among(_cells_around(meet.node[twice], meet.axis[twice], strides), cells).all(axis=1)]
    return Crossings(
        np.concatenate([node[crossed], meet.node[twice]]),
        np.concatenate([axis[crossed], meet.axis[twice]]),
        np.concatenate([place[whole][crossed], meet.place[twice]]),
        cells,
        np.concatenate([normal[whole][crossed], meet.normal[twice]]),
    )


def _may_be_covered(band, edge, place, grid):
    """Whether the distances at the ends of edges (e,), at most as different as the places are far apart, let these
    places (e,3) on them be covered, (e,) bool; the others need no projection."""
    node, axis = np.divmod(edge, 3)
    along = (place - grid.positions(node)).sum(axis=1)
    below, above = (
        np.linalg.norm(band.step[band.rows(end)], axis=1) for end in (node, node + node_strides(grid.shape)[axis])
    )
    least = np.maximum(below - along, above - (grid.spacing - along))
    return least <= (_COVERED + _SLACK) * grid.spacing


def _once(meet):
    """One candidate for each edge that at most one sheet crosses, that one or the least certain; and all crossings of
    edges that several cross."""
    edge, index = numbered(3 * meet.node + meet.axis)
    several = np.bincount(index, meet.crossed, len(edge))[index] > 1
    order = np.lexsort([meet.certainty, ~meet.crossed, index])
    best = order[np.diff(index[order], prepend=-1) > 0]
    return best[~several[best]], np.flatnonzero(several & meet.crossed)


def _cells_around(node, axis, strides):
    first, second = strides[(axis + 1) % 3], strides[(axis + 2) % 3]
    return node[:, None] - np.stack([0 * first, first, first + second, second], axis=1)


def _whole_cells(band, grid):
    """Cells with all corners in the band, by their lowest node, (c,) ascending, and the rows of the corners, (c,8)."""
    at = np.stack(np.unravel_index(band.node, grid.shape), axis=1)
    lowest = band.node[(at < np.array(grid.shape) - 1).all(axis=1)]
    corner = np.stack([band.rows(lowest + step) for step in CORNERS @ node_strides(grid.shape)], axis=1)
    whole = (corner >= 0).all(axis=1)
    return lowest[whole], corner[whole]


def _vote(band, corner, grid, progress):
    """Edges of cells with corners (c,8), as lower node * 3 + axis (e,), votes that they are crossed, positive if so,
    (e,), and the likely places (e,3)."""
    chunks = even_chunks(len(corner), _CHUNK, progress)
    cast = in_order(lambda part: _ballots(band.step[corner[part]], grid), chunks)
    ballots = zip((np.empty(0),) * 3, *(found for _, found in cast), strict=True)
    number = (3 * corner[:, _EDGES[:, 0]] + _EDGE_AXIS).reshape(-1)
    counts = in_order(lambda each: np.bincount(number, np.concatenate(each)), ballots)
    vote, weight, share = (count for _, count in counts)
    voted = np.flatnonzero(weight)
    row, axis = np.divmod(voted, 3)
    share = share[voted] / weight[voted]
    place = grid.positions(band.node[row]) + grid.spacing * share[:, None] * np.eye(3)[axis]
    return 3 * band.node[row] + axis, vote[voted], place


def _ballots(step, grid):
    """For each edge of cells with steps (c,8,3) to their corners, the vote that it is crossed, how certain that is, and
    where along it the surface is, times that; (12 c,) each."""
    side = _sides(step + _HAIR * grid.spacing)
    a, b = side[:, _EDGES[:, 0]].reshape(-1), side[:, _EDGES[:, 1]].reshape(-1)
    certain = np.minimum(np.abs(a), np.abs(b)) + 1e-9 * grid.spacing
    share = np.abs(a) / np.maximum(np.abs(a) + np.abs(b), np.finfo(float).tiny)
    return np.where((a >= 0) != (b >= 0), certain, -certain), certain, certain * share


def _sides(step):
    """Signed distances of the corners of cells along the cell's normal, (c,8), from the steps to them (c,8,3); the sign
    is the cell's own."""
    slope = np.einsum("cki,kj->cij", step, CORNERS - 0.5)
    slope = slope + slope.transpose(0, 2, 1)
    normal = principal_axes(slope[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    return np.einsum("cki,ci->ck", step, normal)
