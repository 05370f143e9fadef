"""Pinholes of a single layer: border loops around a place where the surface is.

Where sheets meet, a border may end at a junction, so a hole beside one is bounded by a piece of border and by edges of
the other sheet.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from ..field.local_surface import LocalSurface
from .mesh import Mesh

_LONGEST = 32  # edges of a loop that may be closed
_DETOUR = 1.5  # of the way along the other sheet, relative to the straight one
_NEAR = 0.5  # cells, the surface is where it is this near
_UNSEEN = 2.0  # cells, narrower openings are below what the grid shows


def fill_pinholes(mesh: Mesh, surface: LocalSurface, cell: float) -> Mesh:
    """Close border loops by a fan of triangles around their middle: those of at most 32 edges that are no wider than
    the bridging length or than two cells, or whose middle and spokes lie on the surface. Wider openings stay."""
    edges, counts = mesh.edge_counts()
    loops, paths = _simple_loops(edges[counts == 1])
    loops += _closed(paths, mesh, edges[counts > 1])
    loops = [loop for loop in loops if len(loop) <= _LONGEST]
    if not loops:
        return mesh
    length = np.array([len(loop) for loop in loops])
    first = np.cumsum(length) - length
    corner, loop = np.concatenate(loops), np.repeat(np.arange(len(loops)), length)
    following = np.concatenate([np.roll(loop, -1) for loop in loops])
    at = mesh.vertices[corner]
    middle = np.add.reduceat(at, first) / length[:, None]
    found = surface.project(middle)
    spokes = surface.project(0.5 * (at + middle[loop])).distance
    farthest = np.maximum(found.distance, np.maximum.reduceat(spokes, first))
    width = 2 * np.maximum.reduceat(np.linalg.norm(at - middle[loop], axis=1), first)
    bridged = surface.bridge * surface.spacing[surface.tree.query(middle, workers=-1)[1]]
    closed = (width <= np.maximum(bridged, _UNSEEN * cell)) | (farthest <= _NEAR * cell)

    apex = len(mesh.vertices) + np.cumsum(closed) - 1
    fan = np.stack([corner, following, apex[loop]], axis=1)[closed[loop]]
    return Mesh(
        np.concatenate([mesh.vertices, middle[closed] - found.step[closed]]),
        np.concatenate([mesh.faces, fan]).astype(np.int32),
        mesh.pairs,
    )


def _closed(paths, mesh, edges):
    """Loops of the paths that the shortest way along `edges` (e,2) closes without a detour."""
    length = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    length = np.maximum(length, np.finfo(float).tiny)
    graph = coo_matrix((length, tuple(edges.T)), shape=(len(mesh.vertices),) * 2).tocsr()
    loops = []
    for path in paths:
        if not 3 <= len(path) <= _LONGEST:
            continue
        start, end = path[0], path[-1]
        farthest = _DETOUR * np.linalg.norm(mesh.vertices[start] - mesh.vertices[end])
        reached, before = dijkstra(graph, directed=False, indices=start, limit=farthest, return_predecessors=True)
        way = [end]
        while np.isfinite(reached[end]) and before[way[-1]] != start:
            way.append(before[way[-1]])
        if np.isfinite(reached[end]) and not set(way[1:]) & set(path):
            loops.append(np.array([*path, *way[1:]]))
    return loops


def _simple_loops(edges) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Loops that pass no vertex twice, and the paths that are left, as vertices in order, out of undirected edges
    (e,2): loops that touch are parted where they do."""
    left = {}
    for a, b in edges.tolist():
        left.setdefault(a, set()).add(b)
        left.setdefault(b, set()).add(a)
    loops, dead = [], []
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
    left = {}
    for a, b in edges:
        left.setdefault(a, set()).add(b)
        left.setdefault(b, set()).add(a)
    paths = []
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
