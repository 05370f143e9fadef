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

from ...field.grid import Grid, node_strides
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...linalg import COMPONENTS, dots, principal_axes, row_dots
from ...lookup import least_of_each, mask_of, numbered
from ...parallel import even_chunks, in_order, work_through
from ...progress import Progress
from ...trees import k_nearest
from .first_steps import first_steps
from .meeting_edges import meeting_edges
from .meetings import Meetings, find_meetings
from .mending import mend, odd_faces

_COVERED = 0.5  # cells, a crossing this close to the surface is on it, a farther one is past its rim
_SLACK = 0.1  # cells, by which distances may jump where another sheet becomes the nearest
_HAIR = np.array([0.02, 0.014, 0.009])  # cells; nodes on the surface, as on grid-aligned walls, all take one side by it
_LEVEL = 0.99  # cosine between the normal of a sheet and an axis of the grid from which on it is level with it
_OFF, _AROUND = 0.02, 8  # cells, by which a foot is off the plane of a sample of another sheet; samples asked then
_TURNED = 8  # steps along edges from odd faces, up to where edges are turned over
_CHUNK = 1 << 15  # cells

_EDGES = np.array(
    [(low, low + step) for step in (4, 2, 1) for low in range(8) if not low & step]
)  # of CORNERS, by axis


@dataclass(frozen=True)
class Crossings:
    """Grid edges that the surface crosses.

    node     : (e,) int64, flat index of the edge's lower node
    axis     : (e,) int64, its direction
    place    : (e,3) float64, where, on the surface
    normal   : (e,3) float64, of the sheet, where sheets meet; zero elsewhere
    meetings : Meetings of its sheets
    """

    node: np.ndarray
    axis: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    meetings: Meetings

    def cells_around(self, grid: Grid) -> np.ndarray:
        """The four cells around each edge in cyclic order, by their lowest nodes, (e,4)."""
        strides = node_strides(grid.shape)
        first, second = strides[(self.axis + 1) % 3], strides[(self.axis + 2) % 3]
        return self.node[:, None] - np.stack([0 * first, first, first + second, second], axis=1)

    @cached_property
    def changing_sides(self) -> np.ndarray:
        """Edges, as 3 * node + axis, ascending, whose ends are on two sides: crossed an odd number of times."""
        edge, count = np.unique(3 * self.node + self.axis, return_counts=True)
        return edge[count % 2 == 1]


def find_crossings(
    band: NearBand, surface: LocalSurface, grid: Grid, progress=None, meetings: Meetings | None = None
) -> Crossings:
    """Crossings of the zero set, from the nodes near it, and the `meetings` of sheets where these are known already.
    On the way edges are called 3 * row + axis, by the row of the lower node in the band. Raises :class:`InputError` for
    a band of another grid or one that does not hold the surface."""
    grid.check(surface.points, band.shape)
    progress = Progress.of(progress)
    meetings = meetings or find_meetings(surface, progress.part(0.0, 0.1))
    meet = meeting_edges(band, surface, grid, meetings, _HAIR * grid.spacing, progress.part(0.1, 0.4))
    progress(0.4)
    lowest, corner = band.whole_cells(np.arange(len(band.node)))
    once, twice = (each[_in_whole_cells(band, lowest, meet.edge[each])] for each in _once(meet))
    edge, vote, share = _vote(band, corner, surface, grid, progress.part(0.4, 0.5))
    alone = _may_be_covered(band, edge, share, grid)
    alone[np.isin(edge, meet.zone, kind="table")] = False
    alone = np.flatnonzero(alone)
    alone = alone[_in_whole_cells(band, lowest, edge[alone])]

    edge, vote, share = edge[alone], vote[alone], share[alone]
    known = meet.edge[once[meet.crossed[once]]]
    on, place = _on_surface(edge, vote > 0, share, known, band, surface, grid, progress.part(0.5, 0.9))
    every = np.append(edge[on], meet.edge[once])
    crossed = np.append(vote[on] > 0, meet.crossed[once])
    mend(band, every, crossed, np.append(np.abs(vote[on]), meet.certainty[once]))
    progress(0.98)
    place = np.concatenate([place, meet.place[once]])
    normal = np.concatenate([np.zeros((len(on), 3)), meet.normal[once]])
    row, axis = np.divmod(np.append(every[crossed], meet.edge[twice]), 3)
    return Crossings(
        band.node[row],
        axis,
        np.concatenate([place[crossed], meet.place[twice]]),
        np.concatenate([normal[crossed], meet.normal[twice]]),
        meetings,
    )


def _on_surface(edge, likely, share, known, band, surface, grid, progress):
    """Which of some edges (e,) the surface reaches, (r,), and where, (r,3): of those that it is `likely` (e,) to cross,
    and of others beside faces that these and the `known` ones leave odd, where edges may yet be turned over."""

    def reached(chosen, part):
        row, axis = np.divmod(edge[chosen], 3)
        place = grid.positions(band.node[row]) + grid.spacing * share[chosen, None] * np.eye(3)[axis]
        step, _ = first_steps(place, band, surface, grid, part)
        on = np.linalg.norm(step, axis=1) <= _COVERED * grid.spacing
        return chosen[on], place[on] - step[on]

    on, place = reached(np.flatnonzero(likely), progress.part(0.0, 0.5))
    odd = odd_faces(band, np.append(edge[on], known))
    rest = np.flatnonzero(~likely & _beside(band, odd // 3)[edge // 3])
    more, there = reached(rest, progress.part(0.5, 1.0))
    return np.append(on, more), np.concatenate([place, there])


def _beside(band, row):
    """Nodes of the band, (b,) bool, at most 8 steps along grid edges from those of some rows."""
    reached = np.zeros(len(band.node) + 1, bool)
    for _ in range(_TURNED):
        reached[row] = True
        around = np.concatenate([band.ahead[:, row], band.behind[:, row]], axis=None)
        row = np.unique(around[~reached[around]])
    return reached[:-1]


def _may_be_covered(band, edge, share, grid):
    """Whether the distances at the ends of edges (e,), at most as different as places are far apart, let the place at
    this `share` (e,) of each be covered, (e,) bool; the others need no projection."""
    row, axis = np.divmod(edge, 3)
    away, along = np.linalg.norm(band.step, axis=1), share * grid.spacing
    least = np.maximum(away[row] - along, away[band.ahead[axis, row]] - (grid.spacing - along))
    return least <= (_COVERED + _SLACK) * grid.spacing


def _once(meet):
    """One candidate for each edge that at most one sheet crosses, that one or the least certain; and all crossings of
    edges that several cross."""
    edge, index = numbered(meet.edge)
    several = np.bincount(index, meet.crossed, len(edge))[index] > 1
    best = least_of_each(index, ~meet.crossed, meet.certainty)
    return best[~several[best]], np.flatnonzero(several & meet.crossed)


def _in_whole_cells(band, lowest, edge):
    """Which edges (e,) have four cells around them whose lowest nodes are among the rows `lowest`, (e,) bool."""
    whole = mask_of(lowest, len(band.node) + 1)
    row, axis = np.divmod(edge, 3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    back = band.behind[first, row]
    return whole[row] & whole[back] & whole[band.behind[second, back]] & whole[band.behind[second, row]]


def _vote(band, corner, surface, grid, progress):
    """Edges of cells with corners (8,c), (e,) ascending, votes that they are crossed, positive if so, (e,), and which
    share of each is likely below the surface, (e,)."""
    steps = _off_surface(band, surface, grid, progress.part(0.0, 0.3))
    chunks = even_chunks(corner.shape[1], _CHUNK, progress.part(0.3, 1.0))
    cast = in_order(lambda part: _ballots(steps.take(corner[:, part], axis=1), grid.spacing), chunks)
    ballots = zip((np.empty((12, 0)),) * 3, *(found for _, found in cast), strict=True)
    lowest = [corner[edges].reshape(-1) for edges in np.split(_EDGES[:, 0], 3)]

    def count(ballot):
        by_axis = np.concatenate(ballot, axis=1).reshape(3, -1)
        counts = [np.bincount(low, along, len(band.node)) for low, along in zip(lowest, by_axis, strict=True)]
        return np.stack(counts, axis=1).reshape(-1)

    vote, weight, share = (found for _, found in in_order(count, ballots))
    voted = np.flatnonzero(weight)
    return voted, vote[voted], share[voted] / weight[voted]


def _off_surface(band, surface, grid, progress):
    """The steps to the nodes, (3,b), from a hair off the surface, so that no node lies on it. Next to sheets level with
    the grid, which whole layers of nodes may lie on, the hair goes across the sheet: the cells along a crease, whose
    normal is of neither wall, see a node on the side that the walls' own cells see it on."""
    steps, hair = np.empty((3, len(band.node))), grid.spacing * _HAIR

    def move(part):
        step = band.step[part]
        foot = grid.positions(band.node[part]) - step
        normals = _normals_at_feet(foot, band.sample[part], surface, _OFF * grid.spacing)
        steps[:, part] = (step + np.where(_level(normals)[:, None], (normals @ hair)[:, None] * normals, hair)).T

    work_through(move, even_chunks(len(band.node), _CHUNK, progress))
    return steps


def _normals_at_feet(foot, sample, surface, off):
    """Normals (m,3) of samples (m,), or of others near foot points (m,3) that are farther than `off` from the planes of
    those, on another sheet; of sheets level with the grid alone."""
    normals = surface.normals[sample]
    row = np.flatnonzero(_level(normals))
    height = row_dots(foot[row] - surface.points[sample[row]], normals[row])
    row = row[np.abs(height) > off]
    around = k_nearest(surface.tree, foot[row], _AROUND)[1]
    height = row_dots(foot[row, None] - surface.points[around], surface.normals[around])
    normals[row] = surface.normals[around[np.arange(len(row)), np.abs(height).argmin(axis=1)]]
    return normals


def _level(normals):
    """Which sheets with these normals (n,3) are level with the grid, (n,) bool."""
    return np.abs(normals).max(axis=1) > _LEVEL


def _ballots(step, cell):
    """For each edge of cells with steps (3,8,c) to their corners, the vote that it is crossed, how certain that is, and
    where along it the surface is, times that; (12,c) each."""
    side = _sides(step)
    low, high = side[_EDGES[:, 0]], side[_EDGES[:, 1]]
    parted, below, above = (low >= 0) != (high >= 0), np.abs(low), np.abs(high)
    certain = np.minimum(below, above) + 1e-9 * cell
    share = below / np.maximum(below + above, np.finfo(float).tiny)
    return np.where(parted, certain, -certain), certain, certain * share


def _sides(step):
    """Signed distances of the corners of cells along the cell's normal, (8,c), from the steps to them (3,8,c); the sign
    is the cell's own."""
    box = step.reshape(3, 2, 2, 2, -1)
    slope = np.stack([np.diff(box, axis=1 + axis).sum(axis=(1, 2, 3)) for axis in range(3)])
    normal = principal_axes(np.stack([slope[i, j] + slope[j, i] for i, j in COMPONENTS], axis=1))
    return dots(step, normal.T)
