"""Pinholes of a single layer: border loops around a place where the surface is.

Where sheets meet, a border may end at a junction, so a hole beside one is bounded by a piece of border and by edges of
the other sheet.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from ...field.local_surface import LocalSurface
from ...linalg import dots, row_dots, unit
from ...lookup import edge_keys, mask_of, numbered, rows_of, sums_of_each
from ...parts import connected_parts
from ...trees import k_nearest, quick_tree
from ..mesh import Mesh, at_corners, face_normals, turns_around
from ..meshing.fillings import fillings

_LONGEST = 64  # edges of a loop that may be closed
_DETOUR, _CORNER = 1.5, 1.0  # of the way along the other sheet, relative to the straight one, and cells more
_NEAR = 0.5  # cells, the surface is where it is this near
_UNSEEN = 2.0  # cells, narrower openings are below what the grid shows
_DOUBLED = 0.75  # of a loop's border, or of its filling's area, where that would lie on faces that are there
_LARGE = 10.0  # square cells of filling; smaller ones close notches, where faces may lie as close
_ON, _AROUND = 0.25, 8  # cells off a face that a filling lies on it, and how many of the nearest are looked at
_TINY = np.finfo(float).tiny


def fill_pinholes(mesh: Mesh, surface: LocalSurface, cell: float) -> Mesh:
    """Close border loops of at most 64 edges by triangles between their vertices, where these lie on the surface or
    need no edge longer than the bridging length or two cells. Wider openings stay, and so do the rims of small sheets,
    whose filling would double what is there.

    Pieces of border that end at junctions are closed piece by piece first, then those that pass further ones at once.
    """
    borders = _Borders.of(mesh)
    filled = _filled(mesh, borders, borders.loops, [part for parts in borders.parted for part in parts], surface, cell)
    if filled is not mesh:
        borders = _Borders.of(filled)
    whole = [path for path, parts in zip(borders.paths, borders.parted, strict=True) if len(parts) > 1]
    return _filled(filled, borders, [], whole, surface, cell)


@dataclass(frozen=True)
class _Borders:
    """Borders of a mesh: loops, but for those of rims, the paths that are left, and the pieces of each path between
    junctions; `edges` (e,2) are all of the mesh, and `counts` (e,) how many faces each has."""

    edges: np.ndarray
    counts: np.ndarray
    loops: list
    paths: list
    parted: list

    @classmethod
    def of(cls, mesh) -> "_Borders":
        edges, counts = mesh.edge_counts()
        loops, paths = _simple_loops(_without_long_loops(edges[counts == 1]))
        at_junction = mesh.edges.ends_at(counts > 2) > 0
        return cls(edges, counts, loops, paths, [_parted(path, at_junction) for path in paths])


def _filled(mesh, borders, loops, paths, surface, cell):
    edges, counts = borders.edges, borders.counts
    short = [path for path in paths if len(path) <= _LONGEST]
    loops = [loop for loop in [*loops, *_closed(short, mesh, edges[counts > 1], cell)] if len(loop) <= _LONGEST]
    if not loops:
        return mesh
    triangle, loop = fillings(mesh.vertices, loops, edges, mesh.faces, cell)
    longest, off = _reach(mesh.vertices, triangle, loop, loops, surface)
    middle = np.array([mesh.vertices[corners].mean(axis=0) for corners in loops])
    around = surface.around(middle)
    bridged = surface.bridge * np.median(surface.spacing[around], axis=1)
    closed = (longest <= np.maximum(bridged, _UNSEEN * cell)) | (off <= _NEAR * cell)
    closed &= _doubled(mesh, edges[counts == 1], loops) < _DOUBLED
    closed &= _covered(mesh, triangle, loop, len(loops), cell) < _DOUBLED
    if not closed.any():
        return mesh
    triangle = _wound(triangle, loop, loops, mesh)[closed[loop]]
    return replace(mesh, faces=np.concatenate([mesh.faces, triangle]).astype(np.int32))


def _wound(triangle, loop, loops, mesh):
    """Triangles that fill loops, by the number of each, wound as most faces beside it are. They follow the loop's own
    direction, in which those have few of their edges."""
    key = (len(mesh.vertices), 1)
    rims, of = _edges_of(loops)
    along = np.isin(rims @ key, _sides(mesh.faces)[0].astype(np.int64) @ key)
    share = np.bincount(of, along - 0.5)
    return np.where(share[loop, None] > 0, triangle[:, [0, 2, 1]], triangle)


def _reach(vertices, triangle, loop, loops, surface):
    """The longest edge inside each loop's filling, and how far off the surface the filling is, (loops,) each."""
    n, corners = len(vertices), vertices[triangle]
    rims = edge_keys(_edges_of(loops)[0], n)
    longest, off = np.zeros(len(loops)), np.zeros(len(loops))
    np.maximum.at(off, loop, surface.project(corners.mean(axis=1)).distance)
    for k in range(3):
        inner = ~np.isin(edge_keys(triangle[:, [k, k - 1]], n), rims)
        a, b = corners[inner, k], corners[inner, k - 1]
        np.maximum.at(longest, loop[inner], np.linalg.norm(a - b, axis=1))
        np.maximum.at(off, loop[inner], surface.project(0.5 * (a + b)).distance)
    return longest, off


def _doubled(mesh, border, loops):
    """How far the faces at each loop's border lie on the side of its filling, (loops,) in [-1,1]: -1 around a hole, 1
    at the rim of a small flat sheet."""
    n, at_border = len(mesh.vertices), mesh.edges.ends_at(mesh.edges.count == 1) > 0
    ends, beyond = _sides(mesh.faces[at_border[mesh.faces].sum(axis=1) > 1])
    key = edge_keys(ends, n)
    own = np.flatnonzero(np.isin(key, edge_keys(border, n)))
    own = own[np.argsort(key[own])]
    key, beyond = key[own], mesh.vertices[beyond[own]]
    edges, of = _edges_of(loops)
    (tail, head), start = mesh.vertices[edges.T], mesh.vertices[[loop[0] for loop in loops]][of]
    row = rows_of(edge_keys(edges, n), key)
    length = np.linalg.norm(head - tail, axis=1) * (row >= 0)
    axis = unit(sums_of_each(of, np.cross(tail - start, head - start)))
    side = row_dots(unit(np.cross(head - tail, beyond[row] - tail)), axis[of])
    return np.bincount(of, length * side) / np.maximum(np.bincount(of, length), _TINY)


def _covered(mesh, triangle, loop, loops, cell):
    """The share of each loop's filling, by area, whose triangles (t,3) have their middles on faces that are there,
    (loops,) float64, 0 of small ones. The way that closes a piece of border may run across the border's own sheet."""
    area = Mesh(mesh.vertices, triangle).face_areas()
    total = np.bincount(loop, area, loops)
    large = (total >= _LARGE * cell**2)[loop]
    if not large.any():
        return np.zeros(loops)
    middle = mesh.vertices[triangle[large]].mean(axis=1)
    a, b, c = at_corners(mesh.vertices, mesh.faces)
    row = k_nearest(quick_tree(((a + b + c) / 3).T), middle, _AROUND, workers=-1)[1]
    a, b, c = (corner[:, row] - middle.T[:, :, None] for corner in (a, b, c))
    normal = face_normals(a, b, c)
    size = np.maximum(np.sqrt(dots(normal, normal)), _TINY)
    within = turns_around(a, b, c, normal).min(axis=0) >= 0
    on = (within & (np.abs(dots(a, normal)) <= _ON * cell * size)).any(axis=1)
    return np.bincount(loop[large], on * area[large], loops) / np.maximum(total, _TINY)


def _edges_of(loops):
    """The edges of loops from each vertex to the next, (s,2) int64, and the number of the loop of each, (s,)."""
    edges = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops]).astype(np.int64)
    return edges, np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])


def _sides(faces):
    """The sides of triangles (f,3), (3f,2), and the corner across from each, (3f,)."""
    return np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]), faces[:, [2, 0, 1]].T.reshape(-1)


def _parted(path, at_junction):
    """The pieces of a path between the vertices that it passes of those marked in `at_junction`, (v,) bool."""
    cut = np.flatnonzero(at_junction[path[1:-1]]) + 1
    return [path[a : b + 1] for a, b in zip([0, *cut], [*cut, len(path) - 1], strict=True)]


def _closed(paths, mesh, edges, cell):
    """Loops of the paths that the shortest way along `edges` (e,2) closes without a detour; rather past the faces at
    the path itself than along them."""
    if not paths:
        return []
    n, ways = len(mesh.vertices), np.concatenate([edges, edges[:, ::-1]])
    length = np.linalg.norm(np.diff(mesh.vertices[ways], axis=1)[:, 0], axis=1)
    graph = coo_matrix((np.maximum(length, _TINY), tuple(ways.T)), shape=(n, n)).tocsr()
    steps = [edge_keys(np.stack([path[:-1], path[1:]], axis=1), n) for path in paths]
    at_path = mask_of(np.concatenate(paths), n)
    ends, beyond = _sides(mesh.faces[at_path[mesh.faces].sum(axis=1) > 1])
    beside = dict(zip(edge_keys(ends, n).tolist(), beyond.tolist(), strict=True))
    loops = []
    for path, step in zip(paths, steps, strict=True):
        farthest = _DETOUR * np.linalg.norm(mesh.vertices[path[0]] - mesh.vertices[path[-1]]) + _CORNER * cell
        own = [corner for corner in (beside[k] for k in step.tolist()) if corner not in (path[0], path[-1])]
        for avoided in ([*path[1:-1], *own], path[1:-1]):
            way = _way(graph, path[0], path[-1], avoided, farthest)
            if way is not None:
                loops.append(np.array([*path, *way]))
                break
    return loops


def _way(graph, start, end, avoided, farthest):
    """The vertices between two on the shortest way back from `end` that passes none of those avoided; None where it is
    too far."""
    passed = np.concatenate([np.empty(0, int), *(np.arange(*graph.indptr[v : v + 2]) for v in avoided)])
    kept, graph.data[passed] = graph.data[passed], np.inf
    reached, before = dijkstra(graph, indices=start, limit=farthest, return_predecessors=True)
    graph.data[passed] = kept
    if not np.isfinite(reached[end]):
        return None
    way = [end]
    while before[way[-1]] != start:
        way.append(before[way[-1]])
    return way[1:]


def _without_long_loops(edges):
    """Border edges (e,2) but those of rims: longer loops than are closed, which touch nothing."""
    corner, ends = numbered(edges)
    part = connected_parts(*ends.T, len(corner))
    branched = np.bincount(part, np.bincount(ends.reshape(-1), minlength=len(corner)) != 2) > 0
    kept = branched | (np.bincount(part) <= _LONGEST)
    return edges[kept[part[ends[:, 0]]]]


def _simple_loops(edges) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Loops that pass no vertex twice, and the paths that are left, as vertices in order, out of undirected edges
    (e,2): loops that touch are parted where they do."""
    left, loops, dead = _neighbours(edges.tolist()), [], []
    for start in sorted(left):
        path, place = [start], {start: 0}
        while path:
            ways = left[path[-1]]
            if not ways:
                del place[path[-1]]
                dead.append(path[-2:])
                path.pop()
                continue
            ahead = min(ways)
            ways.remove(ahead)
            left[ahead].remove(path[-1])
            if ahead not in place:
                place[ahead] = len(path)
                path.append(ahead)
                continue
            back = place[ahead]
            loops.append(np.array(path[back:]))
            for vertex in path[back + 1 :]:
                del place[vertex]
            del path[back + 1 :]
    return loops, _paths([edge for edge in dead if len(edge) == 2])


def _paths(edges):
    """Paths that run through all edges of a forest, each as far as it goes, as vertices in order."""
    left, paths = _neighbours(edges), []
    for start in sorted(left):
        while len(left[start]) % 2:
            path = [start]
            while left[path[-1]]:
                ahead = min(left[path[-1]])
                left[path[-1]].remove(ahead)
                left[ahead].remove(path[-1])
                path.append(ahead)
            paths.append(np.array(path))
    return paths


def _neighbours(edges):
    """The neighbours of each vertex, by the undirected edges (e,2), a dict of sets."""
    found = {}
    for a, b in edges:
        found.setdefault(a, set()).add(b)
        found.setdefault(b, set()).add(a)
    return found
