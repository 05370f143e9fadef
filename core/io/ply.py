"""Meshes and oriented points as binary little-endian PLY.

Positions are written as doubles: georeferenced scans have coordinates of millions of metres, where a float32 step is
half a metre.
"""

import os

import numpy as np
from plyfile import PlyData, PlyElement

from ..surface.mesh import Mesh
from .atomic import atomic_path


def write_mesh(path: str | os.PathLike, mesh: Mesh, attributes: dict[str, np.ndarray] | None = None) -> None:
    """Write `mesh` as `path`: vertices double x, y, z in input units; faces as lists of int32 indices, four of each
    quad, then three of each triangle that is no half of one.

    attributes : further properties of the vertices by name, (v,) each, written in their own type
    """
    vertices = _records(_triple("xyz", mesh.vertices) | (attributes or {}))
    _write(path, PlyElement.describe(vertices, "vertex"), _faces([mesh.quads, mesh.triangles]))


def write_points(
    path: str | os.PathLike, points: np.ndarray, normals: np.ndarray, attributes: dict[str, np.ndarray] | None = None
) -> None:
    """Write `points` (n,3) with their `normals` (n,3) as `path`.

    Properties: double x, y, z in input units; float nx, ny, nz (unit axes); and `attributes` as in :func:`write_mesh`.
    """
    axes = _triple(("nx", "ny", "nz"), np.asarray(normals, np.float32))
    records = _records(_triple("xyz", points) | axes | (attributes or {}))
    _write(path, PlyElement.describe(records, "vertex"))


def _faces(kinds):
    """The element of faces out of quads (q,4) and triangles (t,3)."""
    kinds = [kind for kind in kinds if len(kind)] or kinds[-1:]
    if len(kinds) == 1:
        (kind,) = kinds
        faces = np.empty(len(kind), [("vertex_indices", "<i4", kind.shape[1:])])
        faces["vertex_indices"] = kind
        return PlyElement.describe(faces, "face")
    faces = np.empty(sum(map(len, kinds)), [("vertex_indices", object)])
    faces["vertex_indices"][:] = [face for kind in kinds for face in kind]
    return PlyElement.describe(faces, "face", val_types={"vertex_indices": "i4"})


def _triple(names, block):
    return dict(zip(names, block.T, strict=True))


def _records(fields):
    """Structured little-endian array out of columns (n,) by name."""
    types = [(name, column.dtype.newbyteorder("<")) for name, column in fields.items()]
    records = np.empty(len(next(iter(fields.values()))), types)
    for name, column in fields.items():
        records[name] = column
    return records


def _write(path, *elements):
    with atomic_path(path) as temporary:
        PlyData(elements, byte_order="<").write(str(temporary))
