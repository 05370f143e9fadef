"""The single layer as one side of a double cover."""

import numpy as np

from ...field.blocks import Blocks, at_nodes
from ...field.grid import Grid
from ...field.local_surface import LocalSurface
from ...linalg import lengths, symmetric, unit_columns
from ..mesh import Mesh, at_corners, face_normals
from ..meshing.pieces import pieces_with_samples

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
    middle, normal = corners.mean(axis=0), face_normals(*corners)
    area, normal = lengths(normal), unit_columns(normal)
    side = np.zeros(len(cover.faces))
    for off in _OFF:
        found = at_nodes(signed, grid.nearest_nodes((middle + off * grid.spacing * normal).T))
        side += np.where(np.abs(found) <= _KNOWN * grid.spacing, np.sign(found), 0) / len(_OFF)
    pairs = cover.edges.beside
    beside = symmetric(np.ones(len(pairs[0])), *pairs, len(cover.faces))
    for _ in range(_ROUNDS):
        side = 0.5 * (side + beside @ np.sign(side) / 3)
    front = side > 0
    side_with_more = cover.part(front if area[front].sum() >= area[~front].sum() else ~front)
    return pieces_with_samples(side_with_more, surface.tree, grid.spacing)
