"""The borders of a single layer, made as smooth along themselves as the samples allow.

Dual contouring ends a sheet at whole cells, and a local surface's rims run through its outermost samples; both leave
borders that zigzag. Here each border is faired: the step d off its vertices' places x minimises the integral of
d^2 + (s^2 (x + d)'')^2 along it, an implicit step of bi-Laplacian flow (Desbrun et al., SIGGRAPH 1999) in arc length,
which keeps what is longer than about six smoothing lengths s and does not shorten the border as Laplacian flow does.
At corners (see :mod:`.rim_corners`) it turns as it likes. Reweighting keeps others, where the faired border turns fast,
and holds back vertices that go far.
"""

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from ...field.local_surface import LocalSurface
from ...linalg import COMPONENTS, lengths, principal_axes, row_dots, shortened, unit
from ...lookup import mask_of, sums_of_each
from ..mesh import Mesh, at_corners, face_normals
from .rim_corners import Border

_TO_RIM = 1.5  # cells, how far borders are taken to the surface's rims
_LEAST, _CANCELLED = 1e-3, 1e-6  # cells, as which border edges of no length count; what opposite ones leave at most
_LENGTH = 1.5  # smoothing length, local spacings
_FARTHEST = 0.3  # local spacings, no border moves further
_FREE = 0.25  # local spacings to either side of a corner, where borders turn as they like
_CORNER = 0.5  # radians over the smoothing length, a border that turns faster is held less
_REWEIGHTED = 6
_SHORTEST = 0.2  # cells, shorter edges count as this long
_ROWS, _CLEAR = 2, 2  # beside borders, that are evened out, and beside edges where sheets meet, that are not
_STRETCH, _MOST = 2.0, 90  # further rows for every cell that borders move, at this percentile
_RELAXED, _DAMPING = 10, 0.5


def at_rims(mesh: Mesh, surface: LocalSurface, cell: float) -> np.ndarray:
    """The mesh's vertices (v,3) with those at borders where they fall on the surface from a cell further out: at its
    rims, where these are that near, and a cell and a half off at most."""
    way = _outward(mesh, _LEAST * cell)
    loop = np.flatnonzero(np.linalg.norm(way, axis=1) > _CANCELLED * cell)
    if not len(loop):
        return mesh.vertices
    way, axis, vertices = way[loop], _axes(mesh, loop), mesh.vertices.copy()
    way = unit(way - row_dots(way, axis)[:, None] * axis)
    step = cell * way - surface.project(vertices[loop] + cell * way).step
    vertices[loop] += shortened(step, _TO_RIM * cell)
    return vertices


def smooth_rims(mesh: Mesh, surface: LocalSurface, cell: float, at=None) -> Mesh:
    """The mesh with its borders smoothed along the surface and the rows of vertices beside them evened out.

    cell : the grid's
    at : (v,3), where the borders are smoothed from, or None for the mesh's own vertices; see :func:`at_rims`

    Border vertices move in the surface, by 0.3 local spacings at most; the rows beside them follow, so that triangles
    do not get thin. Vertices of edges with three faces or more stay, and so do those where borders touch and the rows
    next to where sheets meet. The faces are the same.
    """
    edges, counts = mesh.edge_counts()
    border = edges[counts == 1]
    ends, fixed = mesh.edges.ends_at(counts == 1), mesh.edges.ends_at(counts > 2) > 0
    loop = np.flatnonzero((ends == 2) & ~fixed)
    if not len(loop):
        return mesh
    vertices, axis, beside = mesh.vertices.copy(), _axes(mesh, loop), _neighbours(border, loop)
    if at is not None:
        vertices[loop] = at[loop]
    spacing = surface.spacing[surface.tree.query(vertices[loop], workers=-1)[1]]
    step = _fairing(Border(vertices, loop, beside), spacing, cell)
    step -= row_dots(step, axis)[:, None] * axis
    vertices[loop] += shortened(step, _FARTHEST * spacing)
    _settle(vertices, loop, axis, surface)

    moved = vertices - mesh.vertices
    rows = _ROWS + int(np.ceil(_STRETCH * np.percentile(np.linalg.norm(moved[loop], axis=1), _MOST) / cell))
    graph = mesh.edges.links()
    row = np.flatnonzero(_grown(ends > 0, graph, rows) & ~_grown(fixed, graph, _CLEAR) & (ends == 0))
    if not len(row):
        return mesh.moved(vertices)
    graph, axis = graph[row], _axes(mesh, row)
    degree = np.diff(graph.indptr).astype(float)
    vertices[row] += spsolve((diags(degree) - graph[:, row]).tocsc(), graph @ moved)
    for _ in range(_RELAXED):
        step = _DAMPING * (graph @ vertices / degree[:, None] - vertices[row])
        vertices[row] += step - row_dots(step, axis)[:, None] * axis
    _settle(vertices, row, axis, surface)
    return mesh.moved(vertices)


def _outward(mesh, least):
    """Directions (v,3) out of the faces at their borders, zero elsewhere: sums over border edges, by their length, the
    `least` or more."""
    vertices, edges = mesh.vertices, mesh.edges
    tail, head, third = (np.roll(mesh.faces, -k, axis=1).reshape(-1).astype(np.int64) for k in range(3))
    border = (edges.count[edges.number] == 1).reshape(-1)
    tail, head, third = tail[border], head[border], third[border]
    along = vertices[head] - vertices[tail]
    squared = np.maximum(row_dots(along, along), np.finfo(float).tiny)
    out = vertices[tail] - vertices[third]
    out -= (row_dots(out, along) / squared)[:, None] * along
    size = np.linalg.norm(out, axis=1)
    out *= (np.maximum(np.sqrt(squared), least) / np.where(size > 0, size, 1.0))[:, None]
    ends = np.concatenate([tail, head])
    return sums_of_each(ends, np.tile(out, (2, 1)), len(vertices))


def _axes(mesh, row):
    """Normals (r,3) of the vertices `row` (r,), of either sign, whichever way the faces are wound."""
    faces = mesh.faces[mesh.faces_at(mask_of(row, len(mesh.vertices)))]
    normal = face_normals(*at_corners(mesh.vertices, faces))
    normal /= np.sqrt(np.maximum(lengths(normal), np.finfo(float).tiny))
    products = (np.tile(normal[i] * normal[j], 3) for i, j in COMPONENTS)
    corner = faces.T.reshape(-1)
    tensors = [np.bincount(corner, product, len(mesh.vertices))[row] for product in products]
    return principal_axes(np.stack(tensors, axis=1))


def _neighbours(border, loop):
    """The vertices before and after each of `loop` (l,), which have two border edges (e,2) each, (l,2)."""
    tail, head = np.concatenate([border, border[:, ::-1]]).T
    order = np.argsort(tail, kind="stable")
    first = np.searchsorted(tail[order], loop)
    return head[order][first[:, None] + np.arange(2)]


def _fairing(border, spacing, cell):
    """Steps (l,3) that fair the borders."""
    vertices, loop, beside = border.vertices, border.loop, border.beside
    at, every = vertices[loop], np.arange(len(loop))
    h = np.maximum(np.linalg.norm(vertices[beside] - at[:, None], axis=2), _SHORTEST * cell)
    mass = h.mean(axis=1)
    column = np.concatenate([loop, beside[:, 0], beside[:, 1]])
    value = np.concatenate([-(1 / h).sum(axis=1), *(1 / h).T])
    turn = coo_matrix((value, (np.tile(every, 3), column)), shape=(len(loop), len(vertices))).tocsr()
    free = border.within(_FREE * spacing, border.corners(spacing))
    held, weight = mass.copy(), ~free  # x'' is turn @ x / mass
    there, size = turn @ vertices, _LENGTH * spacing
    turn = turn[:, loop]
    for _ in range(_REWEIGHTED):
        stiff = turn.T @ diags(weight * size**4 / mass)
        step = spsolve((diags(held) + stiff @ turn).tocsc(), -(stiff @ there))
        angle = np.linalg.norm(there + turn @ step, axis=1) * size / mass
        weight = ~free / (1 + (angle / _CORNER) ** 4)
        held *= np.maximum(1.0, np.linalg.norm(step, axis=1) / (_FARTHEST * spacing))
    return step


def _grown(chosen, graph, rows):
    """Vertices (v,) bool and those up to so many edges away."""
    for _ in range(rows):
        chosen = chosen | (graph @ chosen > 0)
    return chosen


def _settle(vertices, row, axis, surface):
    """Take the vertices `row` (r,) back onto the surface along their normals (r,3), in place, past its rims too."""
    step = surface.project(vertices[row]).step
    vertices[row] -= row_dots(step, axis)[:, None] * axis
