"""In which order faces follow each other around edges of three and more.

The angles of single faces tell it, but faces are often folded where lines turn, and a sheet would pass to the other
side of the next one there. So the orders around all the edges of a vertex tell it together.
"""

import numpy as np

from ...linalg import cross, dots, lengths, symmetric
from ..mesh import Mesh
from ..mesh_edges import corner_after
from .around_vertices import as_around_vertices


def order_around(sheet: Mesh) -> np.ndarray:
    """The corners (3 f,) of all triangles of a sheet, each standing for the edge from there to the next corner, by edge
    and around each edge in the order of the faces, turning one way about the direction from its lower vertex."""
    edge, count = sheet.edges.number, sheet.edges.count
    order, several = np.argsort(edge.reshape(-1), kind="stable"), np.repeat(count, count)
    line = np.flatnonzero(several > 2)
    if not len(line):
        return order
    corner, on = sheet.faces.reshape(-1), edge.reshape(-1)[order[line]]
    after = corner_after(order[line])
    here, next_, third = corner[order[line]], corner[after], corner[corner_after(after)]
    angle = _angles(sheet, np.minimum(here, next_), np.maximum(here, next_), third)
    sorted_ = np.lexsort((angle, on))
    order[line], angle = order[line][sorted_], angle[sorted_]
    return as_around_vertices(sheet, order, angle)


def _angles(sheet, low, high, third):
    """How far faces with the vertices `low`, `high` and `third`, (m,) each, are turned about the edge from the first to
    the second: (m,) radians, from a direction that is the same for all at this edge. The third vertex is taken in the
    middle of itself and those beside it that are on no such edge, since faces are often folded there."""
    edges, n = sheet.edge_counts()[0], len(sheet.vertices)
    off = np.ones(n, bool)
    off[low], off[high] = False, False
    edges = edges[off[edges].all(axis=1)]
    beside = symmetric(np.ones(len(edges)), *edges.T, n)[third]
    start, middle = sheet.vertices[low], sheet.vertices[third] + beside @ sheet.vertices
    middle /= 1 + np.diff(beside.indptr)[:, None]
    along, to = (sheet.vertices[high] - start).T, (middle - start).T
    across = cross(along, np.eye(3)[:, np.abs(along).argmin(axis=0)])
    return np.arctan2(dots(cross(along, across), to), lengths(along) * dots(across, to))
