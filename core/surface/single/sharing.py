"""Which crossings of a cell share a vertex.

Sheets that cross or end at each other share the vertices of the cells where they do. Sheets that run side by side
within a cell have one each, also where one of them ends.
"""

import numpy as np

from ...field.grid import Grid, node_strides
from ...linalg import row_dots
from ...lookup import numbered
from ...parts import connected_parts
from ..edges.crossings import Crossings
from ..edges.sheets import STEEP

_BENT, _OFF = 0.3, 0.05  # crossings of a sheet are off each other's planes by this share of their distance, and cells


def shared_vertices(crossings: Crossings, grid: Grid) -> tuple[np.ndarray, int, np.ndarray]:
    """The vertices of each crossing's quad, in cyclic order, (e,4) int; their number; and what they are, (v,) int:
    0 on a sheet alone, 1 near a meeting, 2 where sheets meet or one of several in a cell."""
    cell, corner = numbered(crossings.cells_around(grid).reshape(-1))
    owner = np.repeat(np.arange(len(crossings.node)), 4)
    near = (crossings.normal != 0).any(axis=1)[owner]
    mixed = np.bincount(corner, near, len(cell)) > 0
    order = np.argsort(corner, kind="stable")
    count = np.bincount(corner, minlength=len(cell))
    first = np.cumsum(count) - count

    plain = order[~mixed[corner[order]]]
    links = [(plain, order[first[corner[plain]]])]
    steep = np.zeros(len(cell), bool)
    for i in range(count[mixed].max(initial=0)):
        for j in range(i + 1, count[mixed].max(initial=0)):
            row = np.flatnonzero(mixed & (count > j))
            a, b = order[first[row] + i], order[first[row] + j]
            same, meet = _compare(crossings, owner[a], owner[b], grid.spacing)
            steep[row[meet]] = True
            links.append((a[same | meet], b[same | meet]))
    vertex = connected_parts(*(np.concatenate(ends) for ends in zip(*links, strict=True)), len(corner))

    open_cell = np.zeros(len(cell), bool)
    open_cell[corner[_at_end(vertex, corner, cell, crossings, owner, grid)]] = True
    open_cell &= steep
    leader = np.full(len(cell), len(corner))
    np.minimum.at(leader, corner, vertex)
    vertex = np.where(open_cell[corner], leader[corner], vertex)
    _, vertex = numbered(vertex)
    home = np.zeros(vertex.max(initial=-1) + 1, np.int64)
    home[vertex] = corner
    several = np.bincount(home, minlength=len(cell)) > 1
    kind = np.where(mixed, np.where(steep | several, 2, 1), 0)[home]
    return vertex.reshape(-1, 4), len(home), kind


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


def _at_end(vertex, corner, cell, crossings, owner, grid):
    """Whether each corner's sheet ends in its cell: it crosses an odd number of the edges of a face of the cell."""
    strides = node_strides(grid.shape)
    offset = crossings.node[owner] - cell[corner]
    side = np.stack([offset // strides[0], offset % strides[0] // strides[1], offset % strides[1]], axis=1)
    count = np.zeros((vertex.max(initial=-1) + 1, 6), np.int64)
    for turn in (1, 2):
        across = (crossings.axis[owner] + turn) % 3
        np.add.at(count, (vertex, 2 * across + side[np.arange(len(owner)), across]), 1)
    return (count % 2).any(axis=1)[vertex]
