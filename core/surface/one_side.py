"""The single layer as one side of a double cover."""

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix

from ..field.blocks import Blocks, at_nodes
from ..field.grid import Grid
from ..field.local_surface import LocalSurface
from ..linalg import cross, lengths
from .mesh import Mesh, at_corners, edge_numbers, in_use
from .pieces import pieces_with_samples

_OFF = 0.7, 1.0, 1.3  # cells from a face, where its side is told
_KNOWN = 2.5  # cells, up to which signed distances are known
_ROUNDS = 20  # that faces ask those beside them


def one_side(cover: Mesh, signed: np.ndarray | Blocks, surface: LocalSurface, grid: Grid) -> Mesh:
    """The side of a double cover that has more area, by signed distances (nx,ny,nz) float32 or Blocks near the surface,
    which :func:`two_sided` gives: two faces at each edge or one, with ragged borders.

    The cover is on either side of the surface, but not between sheets closer than two cells, where signs change from
    node to node. So of the two walls of something thin, or of a slit, this shows both, one, or none at all, but nowhere
    goes to and fro between them, as the zero set of these distances does.
    """
    corners = np.stack(at_corners(cover.vertices, cover.faces))
    middle, normal = corners.mean(axis=0), cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.maximum(lengths(normal), np.finfo(float).tiny)
    side = np.zeros(len(cover.faces))
    for off in _OFF:
        found = at_nodes(signed, grid.nearest_nodes((middle + off * grid.spacing * normal).T))
        side += np.where(np.abs(found) <= _KNOWN * grid.spacing, np.sign(found), 0) / len(_OFF)
    beside = _beside(cover)
    for _ in range(_ROUNDS):
        side = 0.5 * (side + beside @ np.sign(side) / 3)
    area, front = cover.face_areas(), side > 0
    mesh = cover.of_faces(front if area[front].sum() >= area[~front].sum() else ~front)
    vertices, faces = in_use(mesh.vertices, mesh.faces)
    mesh = replace(mesh, vertices=vertices, faces=faces.astype(np.int32))
    return pieces_with_samples(mesh, surface.tree, grid.spacing)


def _beside(mesh):
    """Which faces share an edge, (f,f) sparse."""
    count, edge = len(mesh.faces), edge_numbers(mesh.faces, len(mesh.vertices))[0].reshape(-1)
    edges_of_faces = coo_matrix((np.ones(3 * count), (np.repeat(np.arange(count), 3), edge))).tocsr()
    beside = edges_of_faces @ edges_of_faces.T
    beside.setdiag(0)
    return beside
