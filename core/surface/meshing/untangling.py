"""Faces that pass through others, where vertices that are pulled onto the surface go past an edge of it.

Next to an outward edge either sheet goes on for a while in the field, so vertices of both may come to lie past the
other one: there the mesh goes round in a loop.
"""

from itertools import chain

import numpy as np

from ...field.local_surface import LocalSurface
from ...linalg import dots, lengths
from ...trees import quick_tree
from ..mesh import Mesh, at_corners, face_normals, turns_around
from .unfolding import smoothed

_BENT = 0.5  # least cosine between the normals of a vertex and of its faces; around what crosses one has less
_AROUND = 3  # rings of faces around these that are looked at
_ROUNDS = 4  # with one step more each time, and a ring of vertices more every second time
_SMALL = 0.98  # share of the faces, above whose size others are looked for apart
_AT_ONCE = 1 << 13  # faces


def untangled(mesh: Mesh, surface: LocalSurface, among=True) -> Mesh:
    """The mesh with vertices of faces that pass through others moved towards the middle of their neighbours (Laplacian
    smoothing), a little further each time, until no two of them do, and from there onto the surface if none do then.

    Vertices at borders stay, those of lines of more than two faces move along these; where faces still cross at last,
    as sheets do that pass through each other, all is left as it was.

    among : (v,) bool, vertices next to which such faces are looked for, or True for all
    """
    loose = _without_crossings(mesh, mesh.vertices, (mesh.normals[1] < _BENT) & among, smoothed)
    row = np.flatnonzero((loose.vertices != mesh.vertices).any(axis=1))
    if not len(row):
        return mesh
    vertices = loose.vertices.copy()
    vertices[row] -= surface.project(vertices[row]).step
    return taken_back(loose.moved(vertices), loose.vertices)


def taken_back(mesh: Mesh, before: np.ndarray) -> Mesh:
    """The mesh with vertices of faces that pass through others where they were `before`, (v,3)."""
    return _without_crossings(mesh, before, (mesh.vertices != before).any(axis=1), None)


def _without_crossings(mesh, before, asked, smooth):
    """The mesh with vertices of faces that cross, one of which has a vertex `asked`, (v,) bool, moved in rounds: by
    `smooth` or, where that is None, to where they were `before`, (v,3). Where faces cross after the last round,
    vertices around go there in any case."""
    if not asked.any():
        return mesh
    near = mesh.faces_at(mesh.around(asked, _AROUND - 1))
    row = np.flatnonzero(mesh.vertices_of(near))
    part, held, start = mesh.part(near), mesh.vertices_of(~near)[row], before[row]
    asked = part.faces_at(asked[row])
    for step in range(_ROUNDS + 1):
        tangled = part.vertices_of(crossing_faces(part, asked).reshape(-1))
        if not tangled.any():
            break
        tangled = part.around(tangled, step // 2)
        if smooth is None or step == _ROUNDS:
            part = part.moved(np.where(tangled[:, None], start, part.vertices))
        else:
            part = smooth(part, tangled & ~held, step + 1)
        asked = part.faces_at(tangled)
    vertices = mesh.vertices.copy()
    vertices[row] = part.vertices
    return mesh.moved(vertices)


def crossing_faces(mesh: Mesh, asked: np.ndarray) -> np.ndarray:
    """Pairs (2,p) of faces that pass through each other, at least one of them among those `asked`, (f,) bool. Faces
    that share an edge count as none that do."""
    corners, faces = np.stack(at_corners(mesh.vertices, mesh.faces)), mesh.faces.T
    one, other = _close(corners, asked)
    same = faces.take(one, axis=1)[:, None] == faces.take(other, axis=1)
    pair = np.flatnonzero(same.sum(axis=(0, 1)) < 2)
    normal, over = face_normals(*corners), []
    for plane, edges, shared in ((one, other, same.any(axis=0)), (other, one, same.any(axis=1))):
        height = _heights(normal, corners, plane.take(pair), edges.take(pair), shared[:, pair])
        cut = (height.min(axis=0) < 0) & (height.max(axis=0) > 0)
        pair, over = pair[cut], [each[:, cut] for each in (*over, height)]
    one, other = one.take(pair), other.take(pair)
    hit = np.zeros(len(one), bool)
    for plane, edges, height in ((one, other, over[0]), (other, one, over[1])):
        for k in range(3):
            start, way = corners[k - 1][:, edges], corners[k][:, edges] - corners[k - 1][:, edges]
            a, b, c = corners[:, :, plane] - start
            turns = turns_around(a, b, c, way)
            through = (turns.min(axis=0) >= 0) | (turns.max(axis=0) <= 0)
            hit |= (height[k - 1] * height[k] < 0) & through
    return np.stack([one[hit], other[hit]])


def _heights(normal, corners, plane, edges, shared):
    """How far the corners of faces `edges` (p,) lie over the planes of faces `plane` (p,), (3,p), times the length of
    the normal; 0 for those `shared`, (3,p) bool."""
    start, way = corners[0].take(plane, axis=1), normal.take(plane, axis=1)
    return np.where(shared, 0.0, [dots(way, corner.take(edges, axis=1) - start) for corner in corners])


def _close(corners, asked):
    """Pairs of faces with `corners` (3,3,f) whose boxes overlap, one of them among those `asked`, (p,) each."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre, radius = 0.5 * (low + high).T, 0.5 * lengths(high - low)
    row, order, pairs = np.flatnonzero(asked), np.argsort(radius, kind="stable"), [np.empty((2, 0), np.intp)]
    for others in np.split(order, [int(_SMALL * len(order))]):
        tree, reach = quick_tree(centre[others]), radius[others].max(initial=0.0)
        for part in np.split(row, range(_AT_ONCE, len(row), _AT_ONCE)):
            near = tree.query_ball_point(centre[part], radius[part] + reach, workers=-1)
            count = np.fromiter(map(len, near), np.intp, len(part))
            other = others.take(np.fromiter(chain.from_iterable(near), np.intp, count.sum()))
            one = np.repeat(part, count)
            kept = np.flatnonzero((one < other) | ~asked.take(other))
            for least, most in zip(low, high, strict=True):
                a, b = one.take(kept), other.take(kept)
                kept = kept[(least.take(a) <= most.take(b)) & (least.take(b) <= most.take(a))]
            pairs.append(np.stack([one[kept], other[kept]]))
    return np.concatenate(pairs, axis=1)
