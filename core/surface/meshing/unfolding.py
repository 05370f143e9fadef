"""Faces that lie back to front on their neighbours, where vertices of a mesh went past one another."""

import numpy as np
from scipy.sparse import coo_matrix

from ...field.local_surface import LocalSurface
from ...linalg import dots, lengths, unit_columns
from ...parts import connected_parts
from ...trees import quick_tree
from ..mesh import Mesh, at_corners, face_normals

_FOLD = -0.5  # cosine between the normals of two faces, below which there is a fold between them
_BENT = 0.5  # least cosine between the normals of a vertex and of its faces; at a fold one has less
_FEW = 16  # faces between folds; where there are more, the surface bends so
_BARE, _BARER = 0.5, 0.25  # cells, that samples may be off the mesh around moved vertices, and further than before
_FLAT = 1e-6  # height of a face over its longest side, below which it has no normal, and counts as folded
_AROUND = 4  # rings of faces around folds that are looked at
_RINGS = 3  # of vertices that are moved, one after the other
_STEPS, _DAMPING = 10, 0.5
_BRANCH = 2  # vertices of lines to either side of where these branch, that stay
_ON = 0.5  # cells, from the surface, where vertices are taken to it


def unfolded(mesh: Mesh, surface: LocalSurface, cell: float, held: np.ndarray | bool = False) -> Mesh:
    """The mesh without small patches between folds, whose faces lie on their neighbours: at borders they go, elsewhere
    the vertices around are moved towards the middle of their neighbours (Laplacian smoothing) and onto the surface.

    held : (v,) bool, vertices that move only if others are not enough, those taken into creases for instance

    Vertices at borders stay, and so do those where the surface itself folds, as layers do at a rim, where lines of more
    than two faces end, and next to where these branch; others of lines move along them. Around those that would leave
    samples bare, as at the tips of thin parts, all is left as it was.
    """
    near = _beside_folds(mesh)
    near[near] = _folded(*_cut_out(mesh, near)[1:])[0]
    if not near.any():
        return mesh
    near = mesh.with_halves(mesh.faces_at(mesh.around(mesh.vertices_of(near), _AROUND)))
    row, part, cut = _cut_out(mesh, near)
    for stays in (cut | np.broadcast_to(held, len(mesh.vertices))[row], cut):
        for rings in range(_RINGS):
            folded, rim = _folded(part, cut)
            flaps = _flaps(part, folded, cut)
            if flaps.any():
                part = part.of_faces(~flaps)
                folded, rim = _folded(part, cut)
            if not folded.any():
                break
            moving = part.around(part.vertices_of(folded), rings) & ~(stays | rim)
            part = _relaxed(part, moving, surface, cell)
    return mesh.with_part(near, row, _where_it_covers(part, mesh.vertices[row], surface, cell))


def _where_it_covers(mesh, before, surface, cell):
    """The mesh with vertices as they were `before`, (v,3), where samples come to lie off it: as tips and thin plates do
    that get blunt."""
    moved = (mesh.vertices != before).any(axis=1)
    low, high = mesh.edges.low, mesh.edges.high
    inside = moved[low] & moved[high]
    group = connected_parts(low[inside], high[inside], len(before))
    vertex = np.flatnonzero(moved)
    around = surface.around(before[vertex])
    sample, first = np.unique(around, return_index=True)
    group_of = group[vertex[first // around.shape[1]]]
    was, now = (_distance(surface.points[sample], x, mesh.faces) for x in (before, mesh.vertices))
    bare = now > np.maximum(was + _BARER * cell, _BARE * cell)
    back = np.isin(group, group_of[bare])
    return mesh.moved(np.where(back[:, None], before, mesh.vertices))


def _distance(points, vertices, faces):
    """Distance (m,) from points (m,3) to the nearest corner, middle of a side, or centroid of faces."""
    corners = vertices[faces]
    places = [corners[:, 0], corners.mean(axis=1), *(0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3))]
    places = np.concatenate([vertices[np.unique(faces)], *places[1:]])
    return quick_tree(places).query(points)[0]


def _beside_folds(mesh):
    """Which faces have a vertex next to a fold, or are half of a quad that has, (f,) bool."""
    return mesh.with_halves(mesh.faces_at(mesh.normals[1] < _BENT))


def _cut_out(mesh, near):
    """The vertices (p,) of the faces `near`, (f,) bool, the mesh of these, in the same order where quads are whole, and
    which of its vertices others have, too, (p,) bool."""
    row = np.flatnonzero(mesh.vertices_of(near))
    return row, mesh.part(near), mesh.vertices_of(~near)[row]


def _folded(mesh, cut):
    """Which faces are few between folds, (f,) bool: connected to no more across edges that are no folds, nor to what is
    `cut` off, (v,) bool; and which vertices are on folds between many faces, (v,) bool."""
    a, b, c = at_corners(mesh.vertices, mesh.faces)
    normal, sides = face_normals(a, b, c), (b - a, c - b, a - c)
    double, normal = lengths(normal), unit_columns(normal)
    flat = double <= _FLAT * np.max([dots(side, side) for side in sides], axis=0)
    (one, other), low, high, count = mesh.edges.beside, mesh.edges.low, mesh.edges.high, mesh.edges.count
    cosine = dots(*(normal.take(face, axis=1) for face in (one, other))) * np.where(mesh.edges.alike, 1, -1)
    fold = (cosine < _FOLD) | flat[one] | flat[other]
    patch = connected_parts(one[~fold], other[~fold], len(mesh.faces))
    goes_on = ((count == 1) & cut[low] & cut[high])[mesh.edges.number].any(axis=1)
    few = (np.bincount(patch)[patch] <= _FEW) & ~np.isin(patch, patch[goes_on])
    beside = np.isin(patch, patch[np.append(one[fold], other[fold])])
    at = np.flatnonzero(count == 2)[fold & ~few[one] & ~few[other]]
    return few & beside, mesh.edges.ends_at(at) > 0


def _flaps(mesh, folded, cut):
    """The faces that are `folded`, (f,) bool, at a border that stays a simple curve without them, (f,) bool, no two of
    them with the corner across it in common; what is `cut` off, (v,) bool, is no border. None at a line of more than
    two faces, unless this is no more than an edge of three."""
    flaps, edges, edge, count = np.zeros(len(folded), bool), mesh.edges, mesh.edges.number, mesh.edges.count
    on_line, on_border = (edges.ends_at(kind) for kind in (count > 2, count == 1))
    border = (count == 1) & ~(cut[edges.low] & cut[edges.high])
    lone = (count == 3) & (on_line[edges.low] == 1) & (on_line[edges.high] == 1)
    row = np.flatnonzero(folded & border[edge].any(axis=1) & ((count <= 2) | lone)[edge].all(axis=1))
    at = border[edge[row]]
    across = np.take_along_axis(mesh.faces[row], (at.argmax(axis=1)[:, None] + 2) % 3, axis=1)[:, 0]
    inside = (on_line[across] == 0) & (on_border[across] == 0)
    simple = (at.sum(axis=1) == 2) | ((at.sum(axis=1) == 1) & (inside | lone[edge[row]].any(axis=1)))
    flaps[row[simple][np.unique(across[simple], return_index=True)[1]]] = True
    return flaps


def _relaxed(mesh, chosen, surface, cell):
    """The mesh with the vertices `chosen`, (v,) bool, that may move among their neighbours and on the surface."""
    mesh, before = smoothed(mesh, chosen, _STEPS), mesh.vertices
    row = np.flatnonzero((mesh.vertices != before).any(axis=1))
    vertices, found = mesh.vertices.copy(), surface.project(mesh.vertices[row])
    on = found.distance <= _ON * cell
    vertices[row[on]] -= found.step[on]
    return mesh.moved(vertices)


def smoothed(mesh: Mesh, chosen: np.ndarray, steps: int) -> Mesh:
    """The mesh with the vertices `chosen`, (v,) bool, moved towards the middle of their neighbours (Laplacian
    smoothing), in so many steps; those at lines of more than two faces along these, but for those at their ends and
    next to where they branch, which stay, as those at borders do."""
    n, vertices, edges = len(mesh.vertices), mesh.vertices.copy(), mesh.edges
    on_line, on_border = (edges.ends_at(kind) for kind in (edges.count > 2, edges.count == 1))
    tail, head = np.append(edges.low, edges.high), np.append(edges.high, edges.low)
    line = np.tile(edges.count > 2, 2)
    stays = on_line > 2
    for _ in range(_BRANCH):
        stays[tail[line & stays[head]]] = True
    stays |= (on_border > 0) | (on_line == 1)
    row = np.flatnonzero(chosen & ~stays)
    if not len(row):
        return mesh
    link = line | (on_line[tail] == 0)
    links = coo_matrix((np.ones(link.sum()), (tail[link], head[link])), shape=(n, n)).tocsr()[row]
    degree = np.diff(links.indptr)[:, None]
    for _ in range(steps):
        vertices[row] += _DAMPING * (links @ vertices / degree - vertices[row])
    return mesh.moved(vertices)
