"""From quads to triangles."""

import numpy as np

from .mesh import Mesh


def mesh_of(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """A mesh out of vertices (v,3) and quads (f,4), which stay pairs of triangles, or triangles (f,3)."""
    quads = len(faces) if faces.shape[1] == 4 else 0
    return Mesh(vertices, triangles(vertices, faces).astype(np.int32), quads)


def triangles(vertices, faces):
    """Triangles of a mesh of quads: (v,3) vertices, (f,4) faces -> (2f,3); triangles (f,3) come back as they are.

    Each quad is split along its shorter diagonal, but not along an edge that the mesh has already, so an edge-manifold
    mesh stays one.
    """
    if faces.shape[1] == 3:
        return faces
    a, b, c, d = (vertices[faces[:, k]] for k in range(4))
    other = np.einsum("fi,fi->f", b - d, b - d) < np.einsum("fi,fi->f", a - c, a - c)
    taken = _keys(faces[:, [0, 1, 2, 3]], faces[:, [1, 2, 3, 0]], len(vertices)).reshape(-1)
    diagonals = np.stack(
        [_keys(faces[:, 0], faces[:, 2], len(vertices)), _keys(faces[:, 1], faces[:, 3], len(vertices))], axis=1
    )
    clash = np.isin(diagonals, taken)
    other = np.where(clash[:, 0] != clash[:, 1], clash[:, 0], other)
    chosen = np.take_along_axis(diagonals, other[:, None].astype(int), axis=1)[:, 0]
    _, first, count = np.unique(chosen, return_index=True, return_counts=True)
    repeated = np.setdiff1d(np.flatnonzero(np.isin(chosen, chosen[first[count > 1]])), first)
    other[repeated] = ~other[repeated]
    turned = np.where(other[:, None], np.roll(faces, -1, axis=1), faces)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def _keys(tail, head, n):
    return np.minimum(tail, head) * n + np.maximum(tail, head)
