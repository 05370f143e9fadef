"""Thin walls of a single layer that is torn, from a double cover that goes around them once."""

import numpy as np
from scipy.spatial import KDTree

from ...field.local_surface import LocalSurface
from ...linalg import dots, unit_columns
from ..mesh import Mesh, at_corners, face_normals
from ..meshing.misfit import chamfer
from ..meshing.pieces import pieces_of, pieces_with_samples
from .orientation import orient

_TWICE = 1 / 3  # of the area of a piece, at most, with the other layer flush with it
_FLUSH = 0.05  # cells; both layers on an open sheet lie so close to each other, the two sheets of a wall do not
_OPPOSITE = -0.5  # cosine between normals of faces on either layer, at most
_AROUND = 12  # faces around one, among them that of the other layer
_ASKED = 1 << 14  # faces, evenly picked out of more
_SMALL = 0.002  # of the area of the cover, smaller pieces are not looked at


def with_thin_walls(sheet: Mesh, unoriented: int, cover: Mesh, surface: LocalSurface, cell: float) -> tuple[Mesh, int]:
    """A single layer with pieces of a double cover extracted at an offset, and the number of its edges across which it
    cannot be wound alike, which is `unoriented` without them. A piece takes the place of what the layer has there where
    it goes around a thin wall, each sheet of which it shows once, and is closer to the surface.

    Between the sheets of a wall no node may lie, and so neither a side nor a crossing that parts them; a single layer
    goes to and fro between the two. The cover is around both, and is what bounds the wall.
    """
    if not len(cover.faces):
        return sheet, unoriented
    count, piece = pieces_of(cover)
    piece, area = piece[cover.faces[:, 0]], cover.face_areas()
    middles = KDTree(_middles(cover))
    asked = slice(None, None, max(len(area) // _ASKED, 1))
    looked, twice = (
        np.bincount(piece[asked], weight, count)
        for weight in (area[asked], area[asked] * _has_other_layer(cover, asked, middles, cell))
    )
    tried = np.flatnonzero((twice < _TWICE * looked) & (looked > _SMALL * looked.sum()))
    if not len(tried):
        return sheet, unoriented
    of, home = (piece[middles.query(x, workers=-1)[1]] for x in (_middles(sheet), surface.points))

    def is_closer(number):
        points = surface.points[home == number]
        ours, theirs = (mesh.part(at == number) for mesh, at in ((cover, piece), (sheet, of)))
        return len(points) and chamfer(ours, surface, cell, points) < chamfer(theirs, surface, cell, points)

    walls = [number for number in tried if is_closer(number)]
    if not walls:
        return sheet, unoriented
    rest, unoriented = orient(sheet.part(~np.isin(of, walls)))
    return pieces_with_samples(rest.joined(cover.part(np.isin(piece, walls))), surface.tree, cell), unoriented


def _has_other_layer(cover, asked, middles, cell):
    """Which faces of a double cover, of those `asked` for, have one of its other layer flush with them, (k,) bool."""
    near = middles.query(middles.data[asked], k=range(2, 2 + min(_AROUND, middles.n - 1)), workers=-1)[1]
    normal = unit_columns(face_normals(*at_corners(cover.vertices, cover.faces)))
    step = (middles.data[near] - middles.data[asked, None]).transpose(2, 0, 1)
    own = normal[:, asked, None]
    flush = np.abs(dots(step, own)) < _FLUSH * cell
    return (flush & (dots(normal[:, near], own) < _OPPOSITE)).any(axis=1)


def _middles(mesh):
    return mesh.vertices[mesh.faces].mean(axis=1)
