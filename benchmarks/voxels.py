"""Points as grids of voxels give them: the cells that a scan was binned to, and the boundary of a segmented volume."""

import igl
import numpy as np
from scipy.ndimage import binary_erosion

from core import Mesh

from .geometry import surface_points

_A_VOXEL = 40  # points on the surface for each face of a voxel of its area, so that hardly one that it meets is missed
_ROOM = 1.5  # voxels beside the surface


def occupied(mesh: Mesh, across: int, rng: np.random.Generator) -> np.ndarray:
    """Centres (n,3) of the voxels that a surface meets, so many across its longest side."""
    side = _side(mesh, across)
    points = surface_points(mesh, int(_A_VOXEL * mesh.face_areas().sum() / side**2), rng)
    return side * (np.unique(np.floor(points / side), axis=0) + 0.5)


def segmented(mesh: Mesh, across: int) -> np.ndarray:
    """Centres (n,3) of the voxels inside a closed surface that have another outside beside one of their faces; up to a
    voxel inside it, that is, and half of one on average."""
    side = _side(mesh, across)
    low, high = (end(mesh.vertices, axis=0) for end in (np.min, np.max))
    steps = (np.arange(a - _ROOM * side, b + _ROOM * side, side) for a, b in zip(low, high, strict=True))
    x = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    winding = igl.fast_winding_number(mesh.vertices, mesh.faces.astype(np.int64), x.reshape(-1, 3))
    volume = np.abs(winding.reshape(x.shape[:3])) > 0.5
    return x[volume & ~binary_erosion(volume)]


def _side(mesh, across):
    return np.ptp(mesh.vertices, axis=0).max() / across
