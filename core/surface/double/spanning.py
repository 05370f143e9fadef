"""Parts of a mesh where there is no surface to pull vertices onto: over openings, and from one sheet to the next."""

import numpy as np
from scipy.sparse import coo_matrix, identity
from scipy.sparse.linalg import spsolve
from scipy.spatial import KDTree

from ...field.local_surface import LocalSurface
from ..mesh_edges import Edges

_BESIDE = 2.0  # levels from an opening that is shut, within which vertices on rims span it, too
_STRETCHED = 3.0  # cells, length of edges; those of the iso-surface have 1.4 at most
_OFF = 0.5  # cells from the surface, of their middles
_HELD = 1e-6  # weight of where a vertex is, beside that of a smooth surface


def spanning_vertices(vertices, step, past_rim, places, level: float) -> np.ndarray:
    """Which vertices (v,3) of an iso-surface belong to openings that were shut at `places` (m,3), (v,) bool: those
    closer to them than to the surface, and those around them whose foot points lie on rims, which end there.

    step     : (v,3), from the foot points to the vertices
    past_rim : (v,) bool, whether these lie on rims     level : float, distance at which the iso-surface was taken
    """
    if not len(places):
        return np.zeros(len(vertices), bool)
    length = np.linalg.norm(step, axis=1)
    farthest = max(length.max(initial=0.0), _BESIDE * level)
    away = KDTree(places).query(vertices, distance_upper_bound=farthest, workers=-1)[0]
    return (away < length) | (past_rim & (away < _BESIDE * level))


def stretched_vertices(vertices, faces, surface: LocalSurface, cell: float) -> np.ndarray:
    """Which vertices (v,3) of triangles or quads (f,k), each on a foot point, are the ends of edges much longer than
    those of the grid whose middles lie off the surface, (v,) bool: where the iso-surface joins sheets, its faces are
    drawn out into spikes from one to the other."""
    edges = Edges(faces, len(vertices))
    tail, head = edges.low, edges.high
    far = np.flatnonzero(((vertices[tail] - vertices[head]) ** 2).sum(axis=1) > (_STRETCHED * cell) ** 2)
    middle = 0.5 * (vertices[tail[far]] + vertices[head[far]])
    far = far[surface.project(middle).distance > _OFF * cell]
    return edges.ends_at(far) > 0


def spanned(vertices: np.ndarray, faces: np.ndarray, loose: np.ndarray) -> np.ndarray:
    """Vertices (v,3) of triangles or quads (f,k), those marked in `loose` (v,) bool moved to where they continue the
    surface around them smoothly: to the least sum of squares of what vertices are off the mean of their neighbours (a
    thin plate; M. Botsch and L. Kobbelt, ACM TOG 23(3), 2004)."""
    free, moved = np.flatnonzero(loose), vertices.copy()
    if not len(free):
        return moved
    n = len(vertices)
    links = Edges(faces, n).links()
    row = np.flatnonzero(loose | (links @ loose.astype(float) > 0))
    links = links[row]
    links.data /= np.repeat(np.diff(links.indptr), np.diff(links.indptr))
    off = links - coo_matrix((np.ones(len(row)), (np.arange(len(row)), row)), shape=links.shape).tocsr()
    plate = off[:, free]
    pull = plate.T @ (off @ vertices)
    moved[free] -= spsolve((plate.T @ plate + _HELD * identity(len(free))).tocsc(), pull)
    return moved
