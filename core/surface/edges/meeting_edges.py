"""Grid edges crossed near places where sheets meet, sheet by sheet."""

from dataclasses import dataclass

import numpy as np

from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...field.steps import NearBand
from ...linalg import row_dots
from ...lookup import least_of_each, mask_of
from ...parallel import in_order
from ...progress import Progress
from .meetings import Meetings
from .sheets import Sheets, one_sheet, sheets_near

_NEAR = 1.4  # cells, from the surface to the nodes that are looked at
_COVERED = 0.5  # cells, a crossing this far past the rim of its sheet is on it
_CUTS = 1.0  # cells, past the rim of a sheet that ends others
_ACROSS = 0.8  # largest |n . n'| of sheets that end at each other
_BEYOND = 0.3  # local spacings, a sheet with no samples further than this past another ends there
_PASSING = 2  # samples of a sheet that pass through others, from which on it does
_GAP = 2.0  # local spacings, the last samples of a sheet are this close to the one it ends at for the gap to be closed
_STEP, _FAR = 1.5, 2.0  # local spacings and cells, places in such a gap are this close to the sheet beyond it
_STRAIGHT = 0.7  # cosine between the way out of the sheet and the way to the other


@dataclass(frozen=True)
class MeetingEdges:
    """Candidates of crossings, each of one edge and one sheet.

    edge      : (e,) int64, 3 * row of its lower node in the band + axis
    place, normal : (e,3) float64, on the sheet     crossed : (e,) bool
    certainty : (e,) float64, distance of the nearer end from the sheet
    zone      : (z,) int64, all edges that were looked at
    """

    edge: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    crossed: np.ndarray
    certainty: np.ndarray
    zone: np.ndarray


def meeting_edges(
    band: NearBand, surface: LocalSurface, grid: Grid, meet: Meetings, hair, progress=None
) -> MeetingEdges:
    """Edges between nodes close to the surface whose nearest sample is where sheets `meet`; `hair` (3,) decides the
    side of nodes that lie on a sheet."""
    progress, cell = Progress.of(progress), grid.spacing
    row = np.flatnonzero(row_dots(band.step, band.step) <= (_NEAR * cell) ** 2)
    row = row[meet.at[band.sample[row]]]
    if not len(row):
        none, nowhere = np.empty(0, np.int64), np.empty((0, 3))
        return MeetingEdges(none, nowhere, nowhere, np.empty(0, bool), np.empty(0), none)
    x, number = grid.positions(band.node[row]), np.full(len(band.node) + 1, -1)
    number[row] = np.arange(len(row))
    ahead, back = number[band.ahead[:, row]], number[band.behind[:, row]]
    sheets = sheets_near(surface, x, [*ahead, *back], cell, progress.part(0.0, 0.9))
    found = [found for _, found in in_order(lambda axis: _along(axis, ahead[axis], sheets, x, cell, hair), range(3))]
    axis = np.repeat(np.arange(3), [len(part[0]) for part in found])
    one, place, normal, crossed, certainty, beyond, near = (np.concatenate(part) for part in zip(*found, strict=True))
    kept = _reaches(place, normal, beyond, sheets, near, surface, meet.through, len(row), cell, hair)
    edge = 3 * row[one[kept]] + axis[kept]
    zone = np.concatenate([3 * row[ahead[a] >= 0] + a for a in range(3)])
    return MeetingEdges(edge, place[kept], normal[kept], crossed[kept], certainty[kept], zone)


def _along(axis, ahead, sheets, x, cell, hair):
    """One line for each edge along an axis and sheet known at both ends: the row of its lower node, the place, the
    normal, whether the ends are on two sides, the distance of the nearer, how far past the rim, and the nearer pair."""
    first, count = sheets.span(len(x))
    tail, head = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for i in range(count.max(initial=0)):
        for j in range(count.max(initial=0)):
            edge = np.flatnonzero((ahead >= 0) & (count > i) & (count[ahead] > j))
            tail.append(first[edge] + i)
            head.append(first[ahead[edge]] + j)
    tail, head = np.concatenate(tail), np.concatenate(head)
    alike, off = one_sheet(sheets, tail, head, cell)
    tail, head, off = tail[alike], head[alike], off[alike]
    mutual = _least(tail, off) & _least(head, off)
    tail, head = tail[mutual], head[mutual]

    a, b = sheets.axis[tail], sheets.axis[head]
    b = b * np.where(row_dots(a, b) < 0, -1.0, 1.0)[:, None]
    below = row_dots(x[sheets.node[tail]] - sheets.foot[tail] + hair, a)
    above = row_dots(x[sheets.node[head]] - sheets.foot[head] + hair, b)
    share = np.abs(below) / np.maximum(np.abs(below) + np.abs(above), np.finfo(float).tiny)
    place = x[sheets.node[tail]] + (share * cell)[:, None] * np.eye(3)[axis]
    normal = (a + b) / np.linalg.norm(a + b, axis=1, keepdims=True)
    certainty = np.minimum(np.abs(below), np.abs(above))
    beyond = (1 - share) * sheets.beyond[tail] + share * sheets.beyond[head]
    crossed = (below >= 0) != (above >= 0)
    return sheets.node[tail], place, normal, crossed, certainty, beyond, np.where(share < 0.5, tail, head)


def _least(key, cost):
    """Whether each line has the least cost of those with its key, (e,) bool; the first of equals."""
    return mask_of(least_of_each(key, cost), len(key))


def _reaches(place, normal, beyond, sheets: Sheets, near, surface, through, nodes, cell, hair):
    """Whether the sheet of each candidate gets there: within its rim and not past another sheet at which it ends, or
    in the gap between its last samples and such a sheet; on which side of that, `hair` decides as for nodes. A sheet
    with samples that pass `through` others, (n,) bool, ends at none."""
    first, count = sheets.span(nodes)
    covered, cut = beyond <= _COVERED * cell, np.zeros(len(place), bool)
    passes = (sheets.member & through[sheets.sample]).sum(axis=1) >= _PASSING
    for i in range(count.max(initial=0)):
        other = first[sheets.node[near]] + i
        row = np.flatnonzero((count[sheets.node[near]] > i) & (other != near))
        row = row[sheets.beyond[other[row]] <= _CUTS * cell]
        row = row[np.abs(row_dots(sheets.axis[other[row]], normal[row])) < _ACROSS]
        own, other = near[row], other[row]
        axis, foot = sheets.axis[other], sheets.foot[other]
        height = row_dots(place[row] - foot + hair, axis)
        up = np.where(height < 0, -1.0, 1.0)
        heights = np.einsum("eki,ei->ek", surface.points[sheets.sample[own]] - foot[:, None], axis) * up[:, None]
        member = sheets.member[own]
        spacing = surface.spacing[sheets.sample[own, sheets.anchor[own]]]
        this_side = np.where(member, heights, -np.inf).max(axis=1) >= _BEYOND * spacing
        cut[row[~this_side & ~passes[own]]] = True
        gap = np.where(member, np.abs(heights), np.inf).min(axis=1)
        out = sheets.outward[own]
        straight = -up * row_dots(out, axis) > _STRAIGHT * np.linalg.norm(out, axis=1)
        short = (gap < _GAP * spacing) & (np.abs(height) <= np.minimum(_STEP * spacing, _FAR * cell))
        covered[row[this_side & straight & short]] = True
    return covered & ~cut
