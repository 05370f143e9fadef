"""Slivers: triangles of hardly any height, as there are where a mesh is flattened against the rim of a sheet."""

from dataclasses import replace

import numpy as np

from ...linalg import dots, lengths, links_in_common
from ...lookup import mask_of
from ..mesh import Mesh, at_corners, face_normals

_SHORT = 0.3  # cells, edges whose ends become one
_FLAT = 0.15  # height of triangles over their longest side, below which this is turned
_LOW = 0.1  # cells, their height, at most: as much the surface moves there
_ALIKE = 0.8  # least cosine between normals of faces before and after
_NO_NORMAL = 0.1  # of the square of short edges, area below which a face has none
_EVEN = 0.01  # weight of either end beside how far it is from flat, in telling where they become one
_ROUNDS, _TIMES = 5, 3  # with longer edges each time; that ends are joined before sides are turned


def without_slivers(mesh: Mesh, cell: float) -> Mesh:
    """A closed manifold mesh without its short edges, whose ends become one vertex (H. Hoppe et al., Mesh optimization,
    SIGGRAPH 1993), and without its flat triangles, whose longest side is turned to the other diagonal; wherever it
    stays a manifold of the same topology, and no other face turns over.

    cell : length of one, in the units of the mesh

    Shorter edges go first, and their ends become one close to that where the mesh bends more: so what lies on a rim is
    one there, and rims and creases stay. A quad is a triangle after one of its sides is gone, and two after one is
    turned.
    """
    near = _around_slivers(mesh, cell)
    if not near.any():
        return mesh
    row, chance = np.unique(mesh.faces[near]), np.random.default_rng(0)
    free = ~np.isin(row, mesh.faces[~near])
    part = mesh.part(near)
    for shortest in np.linspace(0, _SHORT * cell, _ROUNDS + 1)[1:]:
        for _ in range(_TIMES):
            part = _with_ends_joined(part, free, shortest, cell, chance)
        part = _with_sides_turned(part, free, cell)
    return mesh.with_part(near, row, part)


def _around_slivers(mesh, cell):
    """The faces lower than short edges, two rings of faces around them, and the other halves of their quads, (f,)."""
    flatness, longest = _shape(*at_corners(mesh.vertices, mesh.faces))
    near = flatness * longest < _SHORT * cell
    for _ in range(2):
        near = mesh.with_halves(mesh.faces_at(mesh.vertices_of(near)))
    return near


def _shape(a, b, c):
    """Height of triangles over their longest side, by their corners (3,f) each, and that side, (f,)."""
    square = np.max([dots(p - q, p - q) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    square = np.maximum(square, np.finfo(float).tiny)
    return lengths(face_normals(a, b, c)) / square, np.sqrt(square)


def _with_ends_joined(mesh, free, shortest, cell, chance):
    """The mesh with the ends of edges less than `shortest` made one vertex, of as many at once as are no neighbours, in
    an order left to `chance`, a generator; between vertices that are `free`, (v,) bool: all faces of these are there.

    It stays a manifold of its topology where the ends have two neighbours in common, those across the edge, which have
    a neighbour more than these three faces (T. Dey et al., Topology preserving edge contraction, 1999).
    """
    n, x = len(mesh.vertices), mesh.vertices
    low, high = mesh.edges.low, mesh.edges.high
    columns = np.ascontiguousarray(x.T)
    step = columns.take(high, axis=1) - columns.take(low, axis=1)
    short = chance.permutation(np.flatnonzero((dots(step, step) < shortest**2) & free[low] & free[high]))
    links = mesh.edges.links()
    ends = np.stack([low, high])[:, short[links_in_common(links, low[short], high[short]) == 2]]
    ends = ends[:, _no_neighbours(ends, low, high, n)]
    if not ends.size:
        return mesh
    number = np.full(n, -1)
    number[ends] = np.arange(ends.shape[1])
    near = np.flatnonzero(mesh.faces_at(number >= 0))
    faces = mesh.faces[near]
    weight = _EVEN + 1 - _straightness(x, faces)[ends][..., None]
    joined = x.copy()
    joined[ends] = (weight * x[ends]).sum(axis=0) / weight.sum(axis=0)
    at = number[faces]
    edge, gone = at.max(axis=1), (at >= 0).sum(axis=1) == 2
    alike = _alike(*(face_normals(*at_corners(places, faces[~gone])) for places in (x, joined)), cell)
    stays = mask_of(edge[~gone][~alike], ends.shape[1])
    across = faces[gone][at[gone] < 0]
    stays[edge[gone][np.diff(links.indptr)[across] == 3]] = True
    one, other = ends[:, ~stays]
    if not len(one):
        return mesh
    vertices, into = x.copy(), np.arange(n, dtype=mesh.faces.dtype)
    vertices[one], into[other] = joined[one], one
    kept = np.ones(len(mesh.faces), bool)
    kept[near] = ~gone | stays[edge]
    return replace(mesh, vertices=vertices, faces=into[mesh.faces]).of_faces(kept)


def _no_neighbours(ends, low, high, n):
    """Which edges with `ends` (2,e) come before all those that they share an end with, or an edge from `low` to `high`
    leads to, (e,) bool."""
    rank = np.arange(ends.shape[1])
    first = np.full(n, len(rank))
    for end in ends:
        np.minimum.at(first, end, rank)
    near = first.copy()
    np.minimum.at(near, low, first[high])
    np.minimum.at(near, high, first[low])
    return (near[ends] == rank).all(axis=0)


def _straightness(vertices, faces):
    """1 for vertices (v,3) whose faces (f,3) are in a plane, 0 where these lie on each other as at a rim, (v,)."""
    n, corner = len(vertices), faces.reshape(-1)
    normal = face_normals(*at_corners(vertices, faces))
    total = np.stack([np.bincount(corner, np.repeat(x, 3), n) for x in normal])
    area = np.bincount(corner, np.repeat(lengths(normal), 3), n)
    return lengths(total) / np.maximum(area, np.finfo(float).tiny)


def _with_sides_turned(mesh, free, cell):
    """The mesh with the longest sides of flat triangles turned whose apex is `free`, (v,) bool; of as many at once as
    have no face in common."""
    faces = mesh.faces
    corners = at_corners(mesh.vertices, faces)
    flatness, longest = _shape(*corners)
    row = np.flatnonzero((flatness < _FLAT) & (flatness * longest < _LOW * cell))
    row = row[np.argsort(flatness[row], kind="stable")]
    top = np.argmax([lengths(corners[k - 2][:, row] - corners[k - 1][:, row]) for k in range(3)], axis=0)
    edges = mesh.edges
    side = edges.number[row, (top + 1) % 3]
    inner = free[faces[row, top]] & (edges.count[side] == 2)
    row, top, side = row[inner], top[inner], side[inner]
    other = np.bincount(edges.number.reshape(-1), np.repeat(np.arange(len(faces)), 3))[side].astype(np.int64) - row
    c, a, b = (faces[row, (top + k) % 3] for k in range(3))
    d = faces[other].sum(axis=1, dtype=faces.dtype) - a - b
    turned = [np.stack([c, a, d], axis=1), np.stack([c, d, b], axis=1)]
    places = [at_corners(mesh.vertices, each) for each in turned]
    better = np.minimum(*(_shape(*each)[0] for each in places)) > np.minimum(flatness[row], flatness[other])
    normal = face_normals(*(corner[:, other] for corner in corners))
    for each in places:
        better &= _alike(normal, face_normals(*each), cell)
    better &= (c != d) & (edges.faces_between(c, d) == 0)
    can = np.flatnonzero(better)
    first = np.full(len(faces), len(row))
    for face in (row, other):
        np.minimum.at(first, face[can], can)
    can = can[(first[row[can]] == can) & (first[other[can]] == can)]
    can = can[np.unique(np.sort([c[can], d[can]], axis=0), axis=1, return_index=True)[1]]
    if not len(can):
        return mesh
    faces, whole = faces.copy(), np.ones(len(faces), bool)
    for face, each in zip((row, other), turned, strict=True):
        faces[face[can]], whole[face[can]] = each[can], False
    paired = whole[: 2 * mesh.pairs].reshape(2, -1).all(axis=0)
    return replace(mesh, faces=faces).with_quads(paired)


def _alike(before, after, cell):
    """Whether faces have like normals (3,f) `before` and `after`, or had none, (f,) bool."""
    size = lengths(before)
    none = size < _NO_NORMAL * (_SHORT * cell) ** 2
    return none | (dots(before, after) > _ALIKE * size * lengths(after))
