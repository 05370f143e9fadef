"""Faces of a dual mesh made even: its vertices lie where the grid has them, close together here and far apart there."""

import numpy as np

from ...linalg import cross, lengths, row_dots, symmetric
from ...parallel import over_rows
from ..mesh import AT_ONCE, at_corners, edges_of

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
    links = symmetric(np.ones(len(tail)), tail, head, n)
    links, normal, moved = links[free], normal[free], vertices.copy()
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


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (v,3) of the vertices, by area, and the least cosine between each and those of its faces, (v,)."""
    n, corners, columns = len(vertices), faces.T.astype(np.intp), np.asfortranarray(vertices)
    start, end = (0, 1), (2, 3 % len(corners))  # of the diagonals of a quad, of two sides of a triangle
    face, cosine = np.empty((3, len(faces))), np.empty(corners.shape)

    def turn(part):
        places = at_corners(columns, faces[part])
        face[:, part] = cross(*(places[b] - places[a] for a, b in zip(start, end, strict=True)))

    def compare(part):
        unit = face[:, part] / np.maximum(lengths(face[:, part]), np.finfo(float).tiny)
        for corner, found in zip(corners, cosine, strict=True):
            found[part] = np.einsum("if,if->f", unit, normal.take(corner[part], axis=1))

    over_rows(turn, len(faces), AT_ONCE)
    normal = np.stack([sum(np.bincount(corner, x, n) for corner in corners) for x in face])
    normal = normal / np.maximum(lengths(normal), np.finfo(float).tiny)
    over_rows(compare, len(faces), AT_ONCE)
    least = np.ones(n)
    for corner, found in zip(corners, cosine, strict=True):
        np.minimum.at(least, corner, found)
    return normal.T.copy(), least
