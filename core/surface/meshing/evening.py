"""Faces of a dual mesh made even: its vertices lie where the grid has them, close together here and far apart there."""

import numpy as np

from ...linalg import row_dots
from ..mesh import vertex_normals
from ..mesh_edges import Edges

_ROUNDS, _DAMPING = 5, 0.5
FLAT = 0.9  # least cosine between the normals of a vertex and of each face around it, where it may move


def evened(vertices: np.ndarray, faces: np.ndarray, fixed: np.ndarray | bool = False) -> np.ndarray:
    """Vertices (v,3) of triangles or quads (f,k), moved in their tangent planes towards the middle of their neighbours
    (tangential Laplacian smoothing), (v,3).

    Vertices marked in `fixed`, (v,) bool, stay, and so do those of edges without exactly two faces and where the
    surface bends within a face or two, at creases for instance.
    """
    edges = Edges(faces, len(vertices))
    normal, least = vertex_normals(vertices, faces)
    free = np.flatnonzero(~fixed & (least >= FLAT) & (edges.ends_at(edges.count != 2) == 0))
    links, normal, moved = edges.links()[free], normal[free], vertices.copy()
    links.data /= np.repeat(np.diff(links.indptr), np.diff(links.indptr))
    here = moved[free]
    for _ in range(_ROUNDS):
        step = links @ moved
        step -= here
        step -= row_dots(step, normal)[:, None] * normal
        step *= _DAMPING
        here += step
        moved[free] = here
    return moved
