"""Meshes whose vertices lie on the surface, made sharp, free of folds, and centred on it."""

import numpy as np

from ...field.local_surface import LocalSurface
from ...linalg import row_dots
from ...progress import Progress
from ..mesh import Mesh
from .centring import centred
from .corners import into_corners
from .evening import FLAT
from .unfolding import unfolded
from .untangling import taken_back, untangled

_ASIDE, _BACK = 0.3, 0.5  # cells to one side, where the sheet of a vertex is told, and of the foot there off the vertex
_INTO, _INTO_LINES = 1.5, 6.0  # cells, how far a vertex may go into a crease, and to a line where sheets pass through


def finished(mesh: Mesh, passing: np.ndarray, surface: LocalSurface, cell: float, progress: Progress) -> Mesh:
    """The mesh with sharp creases, see :func:`sharpened`, without the folds that these and lines may make, see
    :func:`unfolded`, with its faces astride the surface, see :func:`centred`, and without faces that pass through
    others, see :func:`untangled`. Around vertices that the last moved creases are made sharp once more, unless faces
    pass through others then."""
    sharp = sharpened(mesh, passing, surface, cell, progress.part(0.0, 0.6))
    mesh = centred(unfolded(sharp, surface, cell, held=(sharp.vertices != mesh.vertices).any(axis=1)))
    loose = untangled(mesh, surface, ~_passing(mesh.vertices, passing, surface))
    moved = (loose.vertices != mesh.vertices).any(axis=1)
    if not moved.any():
        return mesh
    sharp = sharpened(loose, passing, surface, cell, progress.part(0.6, 1.0), loose.around(moved))
    return taken_back(sharp, loose.vertices)


def sharpened(
    mesh: Mesh, passing: np.ndarray, surface: LocalSurface, cell: float, progress: Progress, among=True
) -> Mesh:
    """The mesh, whose vertices lie on the surface, with those next to creases taken into them: inward ones, then
    outward ones, which are inward seen from inside. Wedges along lines where sheets pass through one another are
    outward creases; they start far from their edge, and are looked at once more.

    passing : (n,) bool, the samples close to such lines     among : (v,) bool, vertices that may move, or True for all
    """
    ways = (1.0, -1.0, -1.0) if passing.any() else (1.0, -1.0)
    farthest = np.where(_passing(mesh.vertices, passing, surface), _INTO_LINES, _INTO)
    for outward, part in progress.turns(ways):
        vertices, (normal, least) = mesh.vertices, mesh.normals
        row, side = np.flatnonzero(mesh.around(least < FLAT) & among), np.zeros_like(vertices)
        way = outward * normal[row]
        found = surface.project(vertices[row] + _ASIDE * cell * way, part.part(0.0, 0.5))
        direction, back = found.direction, np.linalg.norm(_ASIDE * cell * way - found.step, axis=1) < _BACK * cell
        clear = back & (row_dots(direction, way) > 0) & ~found.past_rim
        side[row[clear]] = direction[clear]
        known = side.any(axis=1)
        beside = mesh.faces[known[mesh.faces].sum(axis=1) >= 2]
        moved = into_corners(vertices, beside, side, surface, cell, part.part(0.5, 1.0), farthest)
        if (moved != vertices).any():
            mesh = mesh.moved(moved)
    return mesh


def _passing(vertices, passing, surface):
    """Which vertices (v,3) are nearest to one of the samples `passing`, (v,) bool."""
    if not passing.any():
        return np.zeros(len(vertices), bool)
    return passing[surface.tree.query(vertices, workers=-1)[1]]
