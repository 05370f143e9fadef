"""From quads to triangles."""

import numpy as np

from ...lookup import edge_keys
from ...parallel import over_rows
from ..mesh import AT_ONCE, Mesh, at_corners, vertex_normals
from ..mesh_edges import Edges
from .evening import FLAT

_EVEN = 1.5  # times the other's squared length, that a diagonal may have
_CURVED = 0.004  # of the length, by which the eightfold rise must differ


def mesh_of(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """A mesh out of vertices (v,3) and quads (f,4), which stay pairs of triangles, or triangles (f,3)."""
    quads = len(faces) if faces.shape[1] == 4 else 0
    return Mesh(vertices, triangles(vertices, faces).astype(np.int32), quads)


def triangles(vertices, faces):
    """Triangles of a mesh of quads: (v,3) vertices, (f,4) faces -> (2f,3); triangles (f,3) come back as they are.

    Each quad is split along the diagonal that runs flatter along the surface, as the normals at its ends tell; along
    the shorter one where that is not clear, or much longer, or the mesh folds there; and not along an edge that the
    mesh has already, so an edge-manifold mesh stays one.
    """
    if faces.shape[1] == 3:
        return faces
    normal, least = vertex_normals(vertices, faces)
    columns, other = (np.asfortranarray(vertices), np.asfortranarray(normal)), np.empty(len(faces), bool)

    def choose(part):
        places, normals = (at_corners(each, faces[part]) for each in columns)
        (length, rise), (other_length, other_rise) = (_diagonal(places[k::2], normals[k::2]) for k in range(2))
        told = np.maximum(length, other_length) < _EVEN * np.minimum(length, other_length)
        told &= (np.abs(rise - other_rise) > _CURVED * np.sqrt(length)) & (least[faces[part]] >= FLAT).all(axis=1)
        other[part] = np.where(told, other_rise < rise, other_length < length)

    over_rows(choose, len(faces), AT_ONCE)
    clash = Edges(faces, len(vertices)).faces_between(faces[:, :2], faces[:, 2:]) > 0
    other = np.where(clash[:, 0] != clash[:, 1], clash[:, 0], other)
    chosen = edge_keys(np.where(other[:, None], faces[:, 1::2], faces[:, ::2]), len(vertices))
    _, first, count = np.unique(chosen, return_index=True, return_counts=True)
    repeated = np.setdiff1d(np.flatnonzero(np.isin(chosen, chosen[first[count > 1]])), first)
    other[repeated] = ~other[repeated]
    turned = np.where(other[:, None], np.roll(faces, -1, axis=1), faces)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def _diagonal(places, normals):
    """Squared lengths (f,) of diagonals, and eight times their rise off the surface, from their two ends (3,f) each and
    the normals there."""
    (a, b), (na, nb) = places, normals
    return np.einsum("if,if->f", b - a, b - a), np.abs(np.einsum("if,if->f", b - a, nb - na))
