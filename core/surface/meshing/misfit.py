"""How far a mesh is from the samples and from the surface, and how much of it is turned away from them."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from ...field.local_surface import LocalSurface
from ...linalg import dots, lengths, unit_columns
from ...trees import k_nearest, quick_tree
from ..mesh import Mesh, at_corners, face_normals

ROUGH = 0.12  # misfit of a mesh where sheets run side by side, beyond which another is looked at
BETTER = 0.5  # times the misfit of one mesh, below which another is taken
SHOWN = 0.005  # of the samples, that one mesh shows and another misses; fewer may be chance
OFF = 0.5  # cells off a mesh, where a sample is missed

_TORN = 0.07  # cells, mean distance of the samples to a mesh, above which it is torn
_ASKEW = 0.1  # of its area, the same where faces are turned away from the samples
_FACES = 4  # that a sample may belong to
_ASKED = 4096  # samples or faces, evenly picked out of more
_NO_AREA = 1e-9  # of the square of a mesh's size, twice the area of one that has none
_TURNED = np.cos(np.pi / 4)


class Misfit(NamedTuple):
    """worst  : how far samples are off a mesh, or how much of it is turned away from them, whichever is worse: 1 and
             more where the mesh is torn
    missed : share of the samples that it misses, by half a cell and more"""

    worst: float
    missed: float


def misfit(mesh: Mesh, surface: LocalSurface, cell: float) -> Misfit:
    """How badly a mesh fits the samples of a surface."""
    off = distances(mesh, _some(surface.points)) / cell
    worst = max(off.mean() / _TORN, askew(mesh, surface.tree, surface.normals) / _ASKEW)
    return Misfit(worst, (off > OFF).mean())


def chamfer(mesh: Mesh, surface: LocalSurface, cell: float, points: np.ndarray | None = None) -> float:
    """Chamfer distance between a mesh and the surface, in cells: the mean distance of the samples to the mesh, and that
    of the mesh, by the area of 4096 and more of its faces, to where the field has the surface; infinite for a mesh
    without area. `points` (n,3) are the samples, where not all of them count.

    Either alone would choose wrong: the first does not see faces where nothing is, the second not what is missing.
    """
    if not len(mesh.faces):
        return np.inf
    a, b, c = at_corners(mesh.vertices, _some(mesh.faces))
    area, off = lengths(face_normals(a, b, c)), surface.project(((a + b + c) / 3).T).distance
    points, total = surface.points if points is None else points, area.sum()
    return (distances(mesh, _some(points)).mean() + off @ area / total) / cell if total else np.inf


def left_out(mesh: Mesh, points: np.ndarray, cell: float) -> np.ndarray:
    """The samples (n,3) that are more than a cell off a mesh by :func:`distances`, (k,3), such as those of a thin part
    that it lacks, which may be few of a large scene."""
    apart = KDTree(mesh.vertices).query(points, distance_upper_bound=cell, workers=-1)[0]
    far = points[np.isinf(apart)]
    return far[distances(mesh, far) > cell] if len(far) else far


def distances(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Distances of points (n,3) to the mesh, in their units, (n,) float64; infinite to one without faces.

    Measured to discs around the centroids of the nearest faces, as large as these: a little less than to the triangles.
    """
    if not len(mesh.faces):
        return np.full(len(points), np.inf)
    corners = np.stack(at_corners(mesh.vertices, mesh.faces))
    centre, normal = corners.mean(axis=0), unit_columns(face_normals(*corners))
    radius = np.max([lengths(corner - centre) for corner in corners], axis=0)
    row = k_nearest(quick_tree(centre.T), points, _FACES, workers=-1)[1]
    off = points.T[:, :, None] - centre[:, row]
    height = dots(off, normal[:, row])
    lateral = np.sqrt(np.maximum(dots(off, off) - height**2, 0)) - radius[row]
    return np.hypot(height, np.maximum(lateral, 0)).min(axis=1)


def askew(mesh: Mesh, tree: KDTree, normals: np.ndarray) -> float:
    """Share of the area of the mesh, of 4096 and more of its faces, that is turned by more than 45 degrees from the
    normal of the nearest sample, of those in the `tree` with `normals` (n,3); 1 for a mesh without area."""
    corners = np.stack(at_corners(mesh.vertices, _some(mesh.faces)))
    normal = face_normals(*corners)
    area, nearest = lengths(normal), tree.query(corners.mean(axis=0).T, workers=-1)[1]
    total, turned = area.sum(), np.abs(dots(normal, normals[nearest].T)) < _TURNED * area
    if not len(area) or total <= _NO_AREA * np.ptp(mesh.vertices, axis=0).max() ** 2:
        return 1.0
    return float(area[turned].sum() / total)


def _some(rows):
    """All rows (n,k), or 4096 and more of them, evenly picked."""
    return rows[:: max(len(rows) // _ASKED, 1)]
