"""Lines where sheets of a single layer meet."""

import numpy as np

from ...field.local_surface import LocalSurface
from ...linalg import row_dots
from ..edges.sheets import STEEP, Sheets, sheets_near
from ..mesh import Mesh
from ..meshing.planes import to_planes

_RINGS = 3  # of vertices around a line, whose sheets are known there
_NEAR = 1.2  # cells, from a vertex to a sheet that counts
_STIFFNESS, _ROUNDS = 0.02, 2


def onto_junctions(mesh: Mesh, surface: LocalSurface, cell: float, progress=None) -> Mesh:
    """The mesh with vertices of edges of more than two faces taken to where the planes of the sheets meet that are
    within 1.2 of the grid's cells: what cells they stand for tells the line along which sheets meet to half a cell.

    The samples nearest to such a vertex may all be of one sheet, so those that vertices around know are told to it.
    """
    line = np.flatnonzero(mesh.edges.ends_at(mesh.edges.count > 2))
    if not len(line):
        return mesh
    around, towards = _around(mesh.edges.links(), line)
    vertices = mesh.vertices.copy()
    sheets = sheets_near(surface, vertices[np.append(line, around)], towards, cell, progress)
    sheets = sheets[(np.abs(sheets.tau) <= _NEAR * cell) & (sheets.node < len(line))]
    meet = _least_cosine(sheets, len(line)) < STEEP
    for _ in range(_ROUNDS):
        step = to_planes(vertices[line], sheets.node, sheets.foot, sheets.axis, _STIFFNESS)
        vertices[line[meet]] += step[meet]
    return mesh.moved(vertices)


def _around(links, line):
    """The vertices at most three edges from those of `line` (l,), by the `links` of all, without these, (a,), and, as
    arrays (l + a,) for both, a vertex of the line that each is so close to, by its place in `line`, -1 where there is
    no further one."""
    reach = links[line]
    for _ in range(_RINGS - 1):
        reach = reach @ links + reach
    to, vertex = reach.nonzero()
    beside = ~np.isin(vertex, line)
    around, at = np.unique(vertex[beside], return_inverse=True)
    order = np.argsort(at, kind="stable")
    at, to = at[order], to[beside][order]
    rank = np.arange(len(at)) - np.searchsorted(at, at)
    towards = np.full((rank.max(initial=-1) + 1, len(line) + len(around)), -1)
    towards[rank, len(line) + at] = to
    return around, list(towards)


def _least_cosine(sheets: Sheets, nodes):
    """The least |n . n'| between the first sheet of each node and its others, (nodes,) float64; 1 where it has none."""
    first, least = sheets.span(nodes)[0][sheets.node], np.ones(nodes)
    np.minimum.at(least, sheets.node, np.abs(row_dots(sheets.axis, sheets.axis[first])))
    return least
