"""Faces of a dual mesh made even: its vertices lie where the grid has them, close together here and far apart there."""

import numpy as np
from scipy.sparse import coo_matrix

from .mesh import edges_of

_ROUNDS, _DAMPING = 5, 0.5
FLAT = 0.9  # least cosine between the normals of a vertex and of each face around it, where it may move


def evened(vertices: np.ndarray, faces: np.ndarray, fixed: np.ndarray | bool = False) -> np.ndarray:
    """Vertices (v,3) of triangles or quads (f,k), moved in their tangent planes towards the middle of their neighbours
    (tangential Laplacian smoothing), (v,3).

    Vertices marked in `fixed`, (v,) bool, stay, and so do those of edges without exactly two faces and where the
    surface bends within a face or two, at creases for instance.
    """
    n = len(vertices)
    (tail, head), count = edges_of(faces, n)
    normal, least = vertex_normals(vertices, faces)
    free = ~fixed & (least >= FLAT)
    free[np.concatenate([tail[count != 2], head[count != 2]])] = False
    free = np.flatnonzero(free)
    links = coo_matrix((np.ones(2 * len(tail)), (np.append(tail, head), np.append(head, tail))), shape=(n, n)).tocsr()
    links, normal, moved = links[free], normal[free], vertices.copy()
    degree = np.diff(links.indptr)[:, None]
    for _ in range(_ROUNDS):
        step = links @ moved / degree - moved[free]
        moved[free] += _DAMPING * (step - np.einsum("vi,vi->v", step, normal)[:, None] * normal)
    return moved


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (v,3) of the vertices, by area, and the least cosine between each and those of its faces, (v,)."""
    n = len(vertices)
    first, second = (0, 2), (1, 3 % faces.shape[1])  # of a quad the diagonals, of a triangle two sides
    along, across = (vertices[faces[:, b]] - vertices[faces[:, a]] for a, b in (first, second))
    face = np.cross(along, across)
    normal = np.stack([sum(np.bincount(corner, x, n) for corner in faces.T) for x in face.T], axis=1)
    normal, face = (
        x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), np.finfo(float).tiny) for x in (normal, face)
    )
    least = np.ones(n)
    for corner in faces.T:
        np.minimum.at(least, corner, np.einsum("fi,fi->f", face, normal[corner]))
    return normal, least
