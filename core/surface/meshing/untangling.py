"""Faces that pass through others, where vertices that are pulled onto the surface go past an edge of it.

Next to an outward edge either sheet goes on for a while in the field, so vertices of both may come to lie past the
other one: there the mesh goes round in a loop.
"""

import numpy as np
from scipy.spatial import KDTree

from ...linalg import cross, dots, lengths
from ...parts import connected_parts
from ..mesh import Mesh, at_corners, face_normals
from .unfolding import smoothed

_BENT = 0.5  # least cosine between the normals of a vertex and of its faces; around what crosses one has less
_ROUNDS = 4  # with one step of smoothing more each time
_USUAL = 99  # per cent of the faces, above whose size others are looked for one by one


def untangled(mesh: Mesh) -> Mesh:
    """The mesh with vertices of faces that pass through others moved towards the middle of their neighbours (Laplacian
    smoothing), a little further each time, until no two of them do.

    Looked for where the mesh bends sharply. Vertices at borders stay, those of lines of more than two faces move along
    these; where faces still cross at last, as sheets do that pass through each other, all is left as it was.
    """
    bent = mesh.normals[1] < _BENT
    if not bent.any():
        return mesh
    near = mesh.faces_at(mesh.vertices_of(mesh.faces_at(bent)))
    row = np.flatnonzero(mesh.vertices_of(near))
    part, held = mesh.part(near), mesh.vertices_of(~near)[row]
    start, asked = part.vertices, np.ones(len(part.faces), bool)
    for step in range(_ROUNDS + 1):
        tangled = part.vertices_of(crossing_faces(part, asked).reshape(-1))
        if step == _ROUNDS or not tangled.any():
            break
        part = smoothed(part, tangled & ~held, step + 1)
        asked = part.faces_at(tangled)
    return mesh.moved(_with(mesh.vertices, row, _back(part, start, tangled)))


def _with(vertices, row, places):
    vertices = vertices.copy()
    vertices[row] = places
    return vertices


def _back(mesh, before, tangled):
    """The vertices of a mesh, as they were `before` (v,3) where those moved hang together with some that are still
    `tangled`, (v,) bool."""
    moved = (mesh.vertices != before).any(axis=1) | tangled
    low, high = mesh.edges.low, mesh.edges.high
    inside = moved[low] & moved[high]
    group = connected_parts(low[inside], high[inside], len(moved))
    return np.where(np.isin(group, group[tangled])[:, None], before, mesh.vertices)


def crossing_faces(mesh: Mesh, asked: np.ndarray) -> np.ndarray:
    """Pairs (2,p) of faces that pass through each other, at least one of them among those `asked`, (f,) bool. Faces
    that share an edge count as none that do."""
    corners = np.stack(at_corners(mesh.vertices, mesh.faces))
    one, other = _close(corners, asked)
    same = mesh.faces[one][:, :, None] == mesh.faces[other][:, None, :]
    apart = same.sum(axis=(1, 2)) < 2
    one, other, same = one[apart], other[apart], same[apart]
    normal = face_normals(*corners)
    over = [_heights(normal[:, one], corners[:, :, other] - corners[0][:, one], same.any(axis=1).T)]
    over.append(_heights(normal[:, other], corners[:, :, one] - corners[0][:, other], same.any(axis=2).T))
    cut = np.all([(each.min(axis=0) < 0) & (each.max(axis=0) > 0) for each in over], axis=0)
    one, other, over = one[cut], other[cut], [each[:, cut] for each in over]
    hit = np.zeros(len(one), bool)
    for plane, edges, height in ((one, other, over[0]), (other, one, over[1])):
        for k in range(3):
            start, way = corners[k - 1][:, edges], corners[k][:, edges] - corners[k - 1][:, edges]
            a, b, c = corners[:, :, plane] - start
            turn = np.stack([dots(way, cross(p, q)) for p, q in ((a, b), (b, c), (c, a))])
            through = (turn.min(axis=0) >= 0) | (turn.max(axis=0) <= 0)
            hit |= (height[k - 1] * height[k] < 0) & through
    return np.stack([one[hit], other[hit]])


def _heights(normal, off, shared):
    """How far corners, `off` (3,3,p) from planes with `normal` (3,p), lie over these, (3,p), times the normal's length;
    0 for those `shared`, (3,p) bool."""
    return np.where(shared, 0.0, [dots(normal, corner) for corner in off])


def _close(corners, asked):
    """Pairs of faces with `corners` (3,3,f) whose boxes overlap, one of them among those `asked`, (p,) each."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre, radius = 0.5 * (low + high).T, 0.5 * lengths(high - low)
    usual = np.percentile(radius, _USUAL)
    small, large = np.flatnonzero(radius <= usual), np.flatnonzero(radius > usual)
    pairs = [small[KDTree(centre[small]).query_pairs(2 * usual, output_type="ndarray").T]]
    for others, reach in ((small, usual), (large, radius.max())) if len(large) else ():
        near = KDTree(centre[others]).query_ball_point(centre[large], radius[large] + reach)
        pairs.append(np.stack([np.repeat(large, [len(each) for each in near]), others[np.concatenate(near).astype(int)]]))
    one, other = np.concatenate(pairs, axis=1)
    ordered = (radius[one] <= usual) | (radius[other] <= usual) | (one < other)
    one, other = (each[ordered & (asked[one] | asked[other])] for each in (one, other))
    overlap = np.maximum(low[:, one], low[:, other]) <= np.minimum(high[:, one], high[:, other])
    kept = overlap.all(axis=0)
    return one[kept], other[kept]
