"""Which crossings of a cell share a vertex.

Sheets that cross or end at each other share the vertices of the cells where they do. Which these are, the faces of the
grid tell, alike to the cells on both sides: two sheets cross on a face where they pass its edges in turns. So the cells
follow each other along the line, and sheets share no vertex off it, which would make handles. Sheets that run side by
side within a cell have one each, also where one of them ends.
"""

import numpy as np

from ...field.grid import Grid, node_strides
from ...linalg import row_dots
from ...lookup import mask_of, numbered
from ...parts import connected_parts
from ..edges.crossings import Crossings
from ..edges.sheets import STEEP

_BENT, _OFF = 0.3, 0.05  # crossings of a sheet are off each other's planes by this share of their distance, and cells


def shared_vertices(crossings: Crossings, grid: Grid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The vertices of each crossing's quad, in cyclic order, (e,4) int; which of them are near a meeting of sheets,
    (v,) bool; and which of those are where sheets meet, or one of several in a cell, (v,) bool."""
    cell, corner = numbered(crossings.cells_around(grid).reshape(-1))
    owner = np.repeat(np.arange(len(crossings.node)), 4)
    near = (crossings.normal != 0).any(axis=1)[owner]
    mixed = np.bincount(corner, near, len(cell)) > 0
    sheet, steep = _sheets_in_cells(crossings, owner, corner, mixed, grid.spacing)

    at = np.flatnonzero(steep[corner])
    face, turn = _on_faces(owner[at], cell[corner[at]], crossings, grid)
    one, other, ended = _lines(sheet[at], corner[at], face, turn, owner[at])
    vertex = connected_parts(one, other, len(corner))[sheet]
    open_cell = mask_of(corner[np.isin(sheet, ended, kind="table")], len(cell))
    leader = np.full(len(cell), len(corner))
    np.minimum.at(leader, corner, vertex)
    vertex = np.where(open_cell[corner], leader[corner], vertex)
    _, vertex = numbered(vertex)
    home = np.zeros(vertex.max(initial=-1) + 1, np.int64)
    home[vertex] = corner
    several = np.bincount(home, minlength=len(cell)) > 1
    return vertex.reshape(-1, 4), mixed[home], (mixed & (steep | several))[home]


def _sheets_in_cells(crossings, owner, corner, mixed, cell):
    """The number of the sheet in its cell that each corner of a quad lies on, (c,), by the crossing `owner` (c,) and
    the cell `corner` (c,) of each; and the cells in which sheets meet, (k,) bool, of those that are `mixed`, (k,) bool.
    In the others there is one sheet."""
    order = np.argsort(corner, kind="stable")
    count = np.bincount(corner, minlength=len(mixed))
    first = np.cumsum(count) - count
    plain = order[~mixed[corner[order]]]
    links = [(plain, order[first[corner[plain]]])]
    steep = np.zeros(len(mixed), bool)
    for i in range(count[mixed].max(initial=0)):
        for j in range(i + 1, count[mixed].max(initial=0)):
            row = np.flatnonzero(mixed & (count > j))
            a, b = order[first[row] + i], order[first[row] + j]
            same, meet = _compare(crossings, owner[a], owner[b], cell)
            steep[row[meet]] = True
            links.append((a[same], b[same]))
    return connected_parts(*(np.concatenate(ends) for ends in zip(*links, strict=True)), len(corner)), steep


def _compare(crossings, a, b, cell):
    """Whether crossings a and b, (m,) each, lie on one sheet, and whether on sheets that meet."""
    gap = crossings.place[a] - crossings.place[b]
    length = np.linalg.norm(gap, axis=1)
    known = [(crossings.normal[c] != 0).any(axis=1)[:, None] for c in (a, b)]
    normals = (
        np.where(known[0], crossings.normal[a], crossings.normal[b]),
        np.where(known[1], crossings.normal[b], crossings.normal[a]),
    )
    off = np.maximum(*(np.abs(row_dots(gap, normal)) for normal in normals))
    level = np.abs(row_dots(*normals)) > STEEP
    meet = ~level & (known[0] & known[1])[:, 0]
    return (off <= _BENT * length + _OFF * cell) & ~meet, meet


def _on_faces(owner, cell, crossings, grid):
    """The two faces of its cell that each crossing lies on, (2,m) int, and how far around each it does, (2,m) in [0,4]:
    the same seen from both cells at a face."""
    axis, strides = crossings.axis[owner], node_strides(grid.shape)
    offset = crossings.node[owner] - cell
    side = np.stack([offset // strides[0], offset % strides[0] // strides[1], offset % strides[1]], axis=1)
    row = np.arange(len(owner))
    along = crossings.place[owner] - grid.positions(crossings.node[owner])
    share = np.clip(along[row, axis] / grid.spacing, 0, 1)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    face = np.stack([2 * first + side[row, first], 2 * second + side[row, second]])
    turn = [np.where(side[row, second] > 0, 1 + share, 4 - share), np.where(side[row, first] > 0, 3 - share, share)]
    return face, np.stack(turn)


def _lines(sheet, corner, face, turn, owner):
    """Pairs of sheets of one cell that cross on a face of it, (p,) each: both pass two of its edges, in turns; and the
    sheets that end in their cell, (q,), which pass an odd number of the edges of a face."""
    sheet, owner, face, turn = np.tile(sheet, 2), np.tile(owner, 2), (6 * corner + face).reshape(-1), turn.reshape(-1)
    order = np.lexsort([owner, turn, face])
    sheet, face = sheet[order], face[order]
    key, group = numbered(face * (sheet.max(initial=0) + 1) + sheet)
    count, place = np.bincount(group, minlength=len(key)), np.arange(len(group))
    start, stop = np.full(len(key), len(group)), np.zeros(len(key), np.int64)
    np.minimum.at(start, group, place)
    np.maximum.at(stop, group, place)
    ended, two = sheet[stop[count % 2 == 1]], count == 2
    start, stop = start[two], stop[two]
    pairs, step = [np.empty((2, 0), np.int64)], 1
    while (near := np.flatnonzero(face[start[step:]] == face[start[:-step]])).size:
        a, b = near, near + step
        begins, ends = ((start[a] < x[b]) & (x[b] < stop[a]) for x in (start, stop))
        pairs.append(sheet[np.stack([start[a], start[b]])[:, begins != ends]])
        step += 1
    return *np.concatenate(pairs, axis=1), ended
