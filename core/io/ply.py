"""Meshes and oriented points as binary little-endian PLY.

Positions are written as doubles: georeferenced scans have coordinates of millions of metres, where a float32 step is
half a metre.
"""

import os
import re

import numpy as np
from plyfile import PlyData, PlyElement

from ..errors import InputError
from ..given_arrays import attribute_rows, points_array, real_numbers
from ..surface.mesh import Mesh
from .atomic import atomic_path
from .own_files import MADE_BY
from .paths import ending_in

_NAME = re.compile(r"[!-~]+")
_TYPES = "i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"


def write_mesh(path: str | os.PathLike, mesh: Mesh, attributes: dict[str, np.ndarray] | None = None) -> None:
    """Write `mesh` as `path`: vertices double x, y, z in input units; faces as lists of int32 indices, four of each
    quad, then three of each triangle that is no half of one.

    attributes : further properties of the vertices by name, (v,) each; written in their own type, or, if PLY has none
                 that long, as int32 where they fit and else as double

    Raises :class:`InputError` for attributes that are not (v,) numbers, or whose names PLY cannot hold or are taken,
    and for paths that do not end in .ply.
    """
    vertices = _records(_triple("xyz", mesh.vertices), attributes)
    _write(path, PlyElement.describe(vertices, "vertex"), _faces([mesh.quads, mesh.triangles]))


def write_points(
    path: str | os.PathLike, points: np.ndarray, normals: np.ndarray, attributes: dict[str, np.ndarray] | None = None
) -> None:
    """Write `points` (n,3) with their `normals` (n,3) as `path`.

    Properties: double x, y, z in input units; float nx, ny, nz (unit axes); and `attributes`. Raises
    :class:`InputError` as :func:`write_mesh` does, and where points and normals are not (n,3) numbers.
    """
    points, axes = points_array(points), real_numbers(normals, "normals", "an (n,3) array")
    if axes.shape != points.shape:
        raise InputError(f"normals have shape {axes.shape} and points {points.shape}; give one for each")
    records = _triple("xyz", points) | _triple(("nx", "ny", "nz"), axes.astype(np.float32))
    records = _records(records, attributes)
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


def _records(fields, attributes):
    """Structured little-endian array out of columns (n,) by name, and of attributes."""
    count = len(next(iter(fields.values())))
    fields = fields | {name: _column(name, values, count, fields) for name, values in (attributes or {}).items()}
    types = [(name, column.dtype.newbyteorder("<")) for name, column in fields.items()]
    records = np.empty(count, types)
    for name, column in fields.items():
        records[name] = column
    return records


def _column(name, values, count, taken):
    values = attribute_rows(name, values, count)
    if name in taken or not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InputError(
            f"a PLY file cannot have an attribute named {name!r}; choose a name without blanks, in ASCII, other than "
            f"{', '.join(taken)}"
        )
    if values.ndim != 1 or values.dtype.kind not in "biuf":
        raise InputError(
            f"attribute {name!r} has shape {values.shape} and type {values.dtype}; give one number for each of "
            f"{count} rows"
        )
    if np.ma.is_masked(values):
        raise InputError(f"attribute {name!r} is masked in {np.ma.count_masked(values)} rows; give a number for each")
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.str[1:] in _TYPES:
        return values
    limits = np.iinfo(np.int32)
    whole = values.dtype.kind in "iu" and limits.min <= values.min(initial=0) and values.max(initial=0) <= limits.max
    return values.astype(np.int32 if whole else np.float64)


def _write(path, *elements):
    with atomic_path(ending_in(".ply", path)) as temporary:
        PlyData(elements, byte_order="<", comments=[MADE_BY]).write(str(temporary))
