"""Pinholes of a single layer: border loops around a place where the surface is."""

import numpy as np

from ..field.local_surface import LocalSurface
from .mesh import Mesh

_LONGEST = 32  # edges of a loop that may be closed
_NEAR = 0.5  # cells, the surface is where it is this near
_UNSEEN = 2.0  # cells, narrower openings are below what the grid shows


def fill_pinholes(mesh: Mesh, surface: LocalSurface, cell: float) -> Mesh:
    """Close border loops by a fan of triangles around their middle: those of at most 32 edges that are no wider than
    the bridging length or than two cells, or whose middle and spokes lie on the surface. Wider openings stay."""
    edges, counts = mesh.edge_counts()
    loops = [loop for loop in _simple_loops(edges[counts == 1]) if len(loop) <= _LONGEST]
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
    )


def _simple_loops(edges) -> list[np.ndarray]:
    """Loops that pass no vertex twice, as vertices in order, out of undirected edges (e,2): loops that touch are parted
    where they do, and edges that lead nowhere are left out."""
    left = {}
    for a, b in edges.tolist():
        left.setdefault(a, set()).add(b)
        left.setdefault(b, set()).add(a)
    loops = []
    for start in sorted(left):
        path, place = [start], {start: 0}
        while path:
            ways = left[path[-1]]
            if not ways:
                del place[path.pop()]
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
    return loops
