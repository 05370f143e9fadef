"""The double cover of a sheet with two sides: the sheet once either way round, joined at its borders."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..errors import InputError
from .evening import vertex_normals
from .layers import HAIR
from .mesh import Mesh, edge_numbers, edge_table, edges_of, looked_up


def both_sides(sheet: Mesh, cell: float) -> Mesh:
    """A closed mesh with a layer on either side of a sheet, wound so that normals point away from it: an outer and an
    inner piece for a closed one, a single piece for an open one, whose layers meet in its border vertices.

    sheet : at most two faces at each edge, wound alike     cell : length of one, in the units of the mesh

    The layers are a hair apart, 3e-4 cells. Where an edge inside of the sheet has both its ends on a border it is
    halved, and where parts of the sheet touch in a vertex each gets its own, so that every edge of the result has two
    faces and those around a vertex form one fan. Raises :class:`InputError` for another sheet.
    """
    _check(sheet)
    sheet = _without_chords(_fans_apart(sheet))
    vertices, faces, n = sheet.vertices, sheet.faces, len(sheet.vertices)
    inside = ~_edges(sheet)[2]
    lift = np.where(inside, 0.5 * HAIR * cell, 0.0)[:, None] * vertex_normals(vertices, faces)[0]
    behind = np.where(inside, n + np.cumsum(inside) - 1, np.arange(n)).astype(faces.dtype)
    halves = np.arange(len(faces))
    halves[: 2 * sheet.pairs] = np.roll(halves[: 2 * sheet.pairs], sheet.pairs)
    back = behind[faces[halves][:, [0, 2, 1]]]
    cuts = [sheet.pairs, 2 * sheet.pairs]
    parts = zip(np.split(faces, cuts), np.split(back, cuts), strict=True)
    return Mesh(
        np.concatenate([vertices + lift, (vertices - lift)[inside]]),
        np.concatenate([part for both in parts for part in both]),
        2 * sheet.pairs,
    )


def _check(sheet):
    edge, count = edge_numbers(sheet.faces, len(sheet.vertices))
    upwards = np.bincount(edge.reshape(-1), (sheet.faces < np.roll(sheet.faces, -1, axis=1)).reshape(-1))
    unfit = int(((upwards > 1) | (count - upwards > 1)).sum())
    if unfit:
        raise InputError(
            f"{unfit} edges of the sheet have more than two faces, or two wound unlike: it has no two sides; use "
            "double_cover"
        )


def _edges(mesh):
    """Both ends of all edges, (2,e), how many faces each has, (e,), and which vertices are on a border, (v,) bool."""
    ends, count = edges_of(mesh.faces, len(mesh.vertices))
    ends, on_border = np.stack(ends), np.zeros(len(mesh.vertices), bool)
    on_border[ends[:, count == 1]] = True
    return ends, count, on_border


def _fans_apart(mesh):
    """The mesh with a vertex for each fan of faces that edges join around a vertex."""
    faces = mesh.faces
    edge, count = edge_numbers(faces, len(mesh.vertices))
    corner = np.arange(faces.size).reshape(faces.shape)
    start, end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    order = np.argsort(edge.reshape(-1), kind="stable")
    one, other = order[count[edge.reshape(-1)[order]] == 2].reshape(-1, 2).T
    links = np.concatenate([start[one], end[one]]), np.concatenate([end[other], start[other]])
    graph = coo_matrix((np.ones(len(links[0]), bool), links), shape=(faces.size,) * 2)
    fans, fan = connected_components(graph, directed=False)
    vertex = np.empty(fans, faces.dtype)
    vertex[fan] = faces.reshape(-1)
    return replace(mesh, vertices=mesh.vertices[vertex], faces=fan.reshape(faces.shape).astype(faces.dtype))


def _without_chords(mesh):
    """The mesh with no edge of two faces that has both its ends on a border: diagonals of quads are turned where the
    other one has not, and what edges are left are halved."""
    mesh, n = _turned(mesh), len(mesh.vertices)
    ends, count, on_border = _edges(mesh)
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


def _turned(mesh):
    """The mesh with the diagonal of each quad turned that leads from border to border where the other one does not, and
    is no edge."""
    _, _, on_border = _edges(mesh)
    quads, table = mesh.quads, edge_table(mesh.faces, len(mesh.vertices))
    row = np.flatnonzero(on_border[quads[:, ::2]].all(axis=1) & ~on_border[quads[:, 1::2]].all(axis=1))
    row = row[looked_up(table, quads[row, 1], quads[row, 3]) == 0]
    faces = mesh.faces.copy()
    faces[row], faces[mesh.pairs + row] = quads[row][:, [1, 2, 3]], quads[row][:, [1, 3, 0]]
    return replace(mesh, faces=faces)
