"""In which order faces follow each other around edges of three and more.

The angles of single faces tell it, but faces are often folded where lines turn, and a sheet would pass to the other
side of the next one there. The order of three sheets stays the same along a line, so all its edges tell it together.
"""

import numpy as np

from ...linalg import cross, dots, lengths, symmetric
from ...parts import connected_parts
from ..mesh import Mesh


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
    three = line[several[line] == 3].reshape(-1, 3)
    order[three] = _as_along_lines(sheet, order[three], angle[several[line] == 3].reshape(-1, 3))
    return order


def corner_after(corner: np.ndarray) -> np.ndarray:
    """The next corner of the same triangle, for corners (m,) numbered three to a face."""
    return np.where(corner % 3 == 2, corner - 2, corner + 1)


def _as_along_lines(sheet, order, angle):
    """The corners (e,3) of edges of three faces, in the order that most edges of the same line have, by how far apart
    their angles (e,3) are, between the same three strips. Since strips are wound alike, one of them tells which way the
    line goes, and another that is there twice goes along the line both ways."""
    corner = sheet.faces.reshape(-1)
    tail, head = corner[order], corner[corner_after(order)]
    strip = _strips(sheet)[order // 3]
    alone = (strip != np.roll(strip, 1, axis=1)) & (strip != np.roll(strip, -1, axis=1))
    turned = (np.where(alone, strip, len(sheet.faces)).argmin(axis=1)[:, None] + np.arange(3)) % 3
    order, strip, upwards = (np.take_along_axis(x, turned, axis=1) for x in (order, strip, tail < head))
    name = 2 * strip + (upwards == upwards[:, :1])
    told = np.flatnonzero(alone.any(axis=1) & (name[:, 1] != name[:, 2]))
    if not len(told):
        return order
    names = np.column_stack([name[told, 0], np.sort(name[told, 1:], axis=1)])
    group = np.unique(names, axis=0, return_inverse=True)[1].reshape(-1)
    turn = np.where(upwards[told, 0] == (name[told, 1] < name[told, 2]), 1, -1)
    apart = np.diff(np.column_stack([angle[told], angle[told, 0] + 2 * np.pi]), axis=1).min(axis=1)
    wrong = told[np.bincount(group, turn * apart)[group] * turn < 0]
    order[wrong] = order[wrong][:, [0, 2, 1]]
    return order


def _strips(sheet):
    """The number of the strip beside a line that each face is in, (f,): faces follow each other there around vertices
    where the line goes on, and are wound alike. At its ends the strips on its sides would be one."""
    edges = sheet.edges
    goes_on = edges.ends_at(edges.count > 2) == 2
    linked = edges.alike & (goes_on[edges.low] | goes_on[edges.high])[edges.count == 2]
    return connected_parts(*(face[linked] for face in edges.beside), len(sheet.faces))


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
