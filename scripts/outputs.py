"""Read back what `python -m core reconstruct` wrote."""

from pathlib import Path

import numpy as np
from plyfile import PlyData

from core import DistanceField, Mesh
from core.io.openvdb_module import load_openvdb


def read_points(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) and normals (n,3), float64, of SCAN_points.ply."""
    vertex = PlyData.read(path)["vertex"]
    return _columns(vertex, "x", "y", "z"), _columns(vertex, "nx", "ny", "nz")


def read_mesh(path: Path) -> Mesh:
    """The mesh of SCAN_double.ply."""
    ply = PlyData.read(path)
    return Mesh(_columns(ply["vertex"], "x", "y", "z"), np.stack(ply["face"]["vertex_indices"]))


def read_field(path: Path) -> DistanceField:
    """The grid `udf` of SCAN.vdb over the box of its active voxels."""
    grid = load_openvdb().read(str(path), "udf")
    low, high = grid.evalActiveVoxelBoundingBox()
    values = np.empty(np.subtract(high, low) + 1, np.float32)
    grid.copyToArray(values, ijk=low)
    return DistanceField(values, np.array(grid.transform.indexToWorld(low)), grid.transform.voxelSize()[0])


def _columns(element, *names):
    return np.stack([element[name] for name in names], axis=1).astype(np.float64)
