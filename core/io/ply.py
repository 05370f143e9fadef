"""Meshes and oriented points as binary little-endian PLY.

Positions are written as doubles: georeferenced scans have coordinates of millions of metres, where a float32 step is
half a metre.
"""

import os

import numpy as np
from plyfile import PlyData, PlyElement

from ..surface.mesh import Mesh
from .atomic import atomic_path


def write_mesh(path: str | os.PathLike, mesh: Mesh) -> None:
    """Write `mesh` as `path`: vertices double x, y, z in input units; faces as lists of three int32 indices."""
    faces = np.empty(len(mesh.faces), [("vertex_indices", "<i4", (3,))])
    faces["vertex_indices"] = mesh.faces
    _write(path, PlyElement.describe(_records(x_y_z=mesh.vertices), "vertex"), PlyElement.describe(faces, "face"))


def write_points(
    path: str | os.PathLike, points: np.ndarray, normals: np.ndarray, confidence: np.ndarray | None = None
) -> None:
    """Write `points` (n,3) with their `normals` (n,3) and, where given, `confidence` (n,) as `path`.

    Properties: double x, y, z in input units; float nx, ny, nz (unit axes); float confidence in [0,1].
    """
    columns = dict(x_y_z=points, nx_ny_nz=np.asarray(normals, np.float32))
    if confidence is not None:
        columns["confidence"] = np.asarray(confidence, np.float32)[:, None]
    _write(path, PlyElement.describe(_records(**columns), "vertex"))


def _records(**columns):
    """Structured array out of (n,k) blocks, each under its k names joined by underscores."""
    fields = {name: block[:, k] for names, block in columns.items() for k, name in enumerate(names.split("_"))}
    records = np.empty(len(next(iter(fields.values()))), [(name, f"<f{x.itemsize}") for name, x in fields.items()])
    for name, column in fields.items():
        records[name] = column
    return records


def _write(path, *elements):
    with atomic_path(path) as temporary:
        PlyData(elements, byte_order="<").write(str(temporary))
