"""The double cover of a sheet: both its sides, joined at its borders."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..errors import InputError
from ..linalg import cross, lengths
from .layers import HAIR
from .mesh import Mesh, at_corners, edge_numbers, edge_table, edges_of, looked_up


def both_sides(sheet: Mesh, cell: float) -> Mesh:
    """A closed mesh with a layer on either side of a sheet, wound so that normals point away from it: an outer and an
    inner piece for a closed one with two sides, a single piece for an open one, whose layers meet in its border
    vertices, and for a one-sided one.

    sheet : at most two faces at each edge, wound alike or not     cell : length of one, in the units of the mesh

    The layers are a hair apart, 3e-4 cells. Where an edge inside of the sheet has both its ends on a border it is
    halved, and where parts of the sheet touch in a vertex each gets its own, so that every edge of the result has two
    faces and those around a vertex form one fan. Raises :class:`InputError` for another sheet.
    """
    edge, count = edge_numbers(sheet.faces, len(sheet.vertices))
    if (count > 2).any():
        raise InputError(f"{(count > 2).sum()} edges of the sheet have more than two faces: use double_cover")
    ends, alone = np.stack([sheet.faces, np.roll(sheet.faces, -1, axis=1)]), count[edge] == 1
    on_border = np.zeros(len(sheet.vertices), bool)
    on_border[ends[:, alone]] = True
    if (on_border[ends].all(axis=0) & ~alone).any():
        sheet = _without_chords(sheet, on_border)
        edge, count = edge_numbers(sheet.faces, len(sheet.vertices))
    front, back, n = _vertices_of_sides(sheet.faces, edge.reshape(-1), count)
    corner = np.empty(n, sheet.faces.dtype)
    corner[front], corner[back] = sheet.faces, sheet.faces
    a, b, c = at_corners(sheet.vertices, sheet.faces)
    normal = np.stack([_total(x, front, n) - _total(x, back, n) for x in cross(b - a, c - a)])
    normal *= 0.5 * HAIR * cell / np.maximum(lengths(normal), np.finfo(float).tiny)  # at borders both sides cancel
    halves = np.arange(len(front))
    halves[: 2 * sheet.pairs] = np.roll(halves[: 2 * sheet.pairs], sheet.pairs)
    cuts = [sheet.pairs, 2 * sheet.pairs]
    parts = zip(np.split(front, cuts), np.split(back[halves][:, [0, 2, 1]], cuts), strict=True)
    faces = np.concatenate([part for both in parts for part in both])
    return Mesh(sheet.vertices[corner] + normal.T, faces, 2 * sheet.pairs)


def _vertices_of_sides(faces, edge, count):
    """For either side of the faces the vertices of a closed mesh at their corners, (f,3) each, and their number: one
    for each fan of sides that edges join, round the border from one side to the other."""
    corners = faces.size
    start = np.arange(corners, dtype=np.int32)
    end = np.roll(start.reshape(faces.shape), -1, axis=1).reshape(-1)
    upwards = (faces < np.roll(faces, -1, axis=1)).reshape(-1)
    order = np.argsort(edge, kind="stable")
    one, other = order[count[edge[order]] == 2].reshape(-1, 2).T
    unlike = upwards[one] == upwards[other]
    ends = np.where(unlike, [start[other], end[other]], [end[other], start[other]])
    border = np.concatenate([each[count[edge] == 1] for each in (start, end)])
    links = [(border, border + corners)]
    for here, there in zip((start[one], end[one]), ends, strict=True):
        across = there + corners
        links += [(here, np.where(unlike, across, there)), (here + corners, np.where(unlike, there, across))]
    links = tuple(np.concatenate(each) for each in zip(*links, strict=True))
    graph = coo_matrix((np.ones(len(links[0]), bool), links), shape=(2 * corners,) * 2)
    n, vertex = connected_components(graph, directed=False)
    front, back = vertex.astype(faces.dtype).reshape(2, *faces.shape)
    return front, back, n


def _total(x, faces, n):
    """Sums of x (f,) over the faces (f,3) of each of n vertices, (n,)."""
    return np.bincount(faces.reshape(-1), np.repeat(x, 3), n)


def _without_chords(mesh, on_border):
    """The mesh with no edge of two faces that has both its ends on a border, `on_border` (v,) bool: diagonals of quads
    are turned where the other one has not, and what edges are left are halved."""
    mesh, n = _turned(mesh, on_border), len(mesh.vertices)
    ends, count = edges_of(mesh.faces, n)
    ends = np.stack(ends)
    low, high = ends[:, (count == 2) & on_border[ends].all(axis=0)]
    if not len(low):
        return mesh
    total = n + len(low)
    middle = coo_matrix((np.arange(n, total), (low, high)), shape=(total, total)).tocsr()
    whole = (looked_up(middle, mesh.faces, np.roll(mesh.faces, -1, axis=1)) == 0).all(axis=1)
    rest, halved = mesh.of_faces(whole), mesh.faces[~whole]
    for _ in range(3):
        found = looked_up(middle, halved, np.roll(halved, -1, axis=1))
        cut = found.any(axis=1)
        side = (found > 0).argmax(axis=1)[:, None]
        a, b, c = np.take_along_axis(halved, (side + np.arange(3)) % 3, axis=1)[cut].T
        m = np.take_along_axis(found, side, axis=1)[cut, 0]
        halved = np.concatenate([halved[~cut], np.stack([a, m, c], axis=1), np.stack([m, b, c], axis=1)])
    vertices = np.concatenate([mesh.vertices, 0.5 * (mesh.vertices[low] + mesh.vertices[high])])
    return replace(rest, vertices=vertices, faces=np.concatenate([rest.faces, halved.astype(rest.faces.dtype)]))


def _turned(mesh, on_border):
    """The mesh with the diagonal of each quad turned that leads from border to border where the other one does not, and
    is no edge."""
    quads, table = mesh.quads, edge_table(mesh.faces, len(mesh.vertices))
    row = np.flatnonzero(on_border[quads[:, ::2]].all(axis=1) & ~on_border[quads[:, 1::2]].all(axis=1))
    row = row[looked_up(table, quads[row, 1], quads[row, 3]) == 0]
    faces = mesh.faces.copy()
    faces[row], faces[mesh.pairs + row] = quads[row][:, [1, 2, 3]], quads[row][:, [1, 3, 0]]
    return replace(mesh, faces=faces)
