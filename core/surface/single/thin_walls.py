"""Thin walls of a single layer that is torn, from a double cover that goes around them once."""

import numpy as np
from scipy.spatial import KDTree

from ...field.local_surface import LocalSurface
from ..mesh import Mesh
from ..meshing.misfit import chamfer
from ..meshing.pieces import pieces_of
from .orientation import orient

_ONCE = 1.25  # times the area of the single layer there; both sides of an open sheet have twice that
_SMALL = 0.002  # of the area of the cover, smaller pieces are not looked at


def with_thin_walls(sheet: Mesh, unoriented: int, cover: Mesh, surface: LocalSurface, cell: float) -> tuple[Mesh, int]:
    """A single layer, with `unoriented` edges across which it is not wound alike, with pieces of a double cover
    extracted at an offset in place of what it has there, where these go around thin walls, each sheet of which they
    show once, and are closer to the surface; and the number of such edges then.

    Between the sheets of a wall no node may lie, and so neither a side nor a crossing that parts them; a single layer
    goes to and fro between the two. The cover is around both, and is what bounds the wall.
    """
    count, piece = pieces_of(cover)
    piece, centres = piece[cover.faces[:, 0]], _centres(cover)
    beside, share = KDTree(centres), np.bincount(piece, cover.face_areas(), count)
    of = piece[beside.query(_centres(sheet), workers=-1)[1]]
    once = share < _ONCE * np.bincount(of, sheet.face_areas(), count)
    tried = np.flatnonzero(once & (share > _SMALL * share.sum()))
    if not len(tried):
        return sheet, unoriented
    home = piece[beside.query(surface.points, workers=-1)[1]]
    walls = [
        number
        for number in tried
        if _closer(cover, piece == number, sheet, of == number, home == number, surface, cell)
    ]
    if not walls:
        return sheet, unoriented
    rest, unoriented = orient(sheet.part(~np.isin(of, walls)))
    return rest.joined(cover.part(np.isin(piece, walls))), unoriented


def _closer(cover, walls, sheet, torn, samples, surface, cell):
    points = surface.points[samples]
    ours, theirs = (chamfer(mesh.part(faces), surface, cell, points) for mesh, faces in ((cover, walls), (sheet, torn)))
    return ours < theirs


def _centres(mesh):
    return mesh.vertices[mesh.faces].mean(axis=1)
