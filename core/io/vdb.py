"""Distance fields as OpenVDB volumes."""

import os
import struct

import numpy as np

from ..errors import InputError, VADError
from ..field.blocks import each, node_gradient
from ..field.distance_field import BandedField, DistanceField
from .atomic import ELSEWHERE, atomic_path
from .openvdb_module import fill, load_openvdb
from .own_files import MADE_BY
from .paths import ending_in

_SMALLEST = 1.5e-5  # the cube of a voxel's size counts as zero below 3e-15
_FOG_CELLS = 2.0  # the visible fog fades out at this distance from the surface


def write_vdb(
    path: str | os.PathLike, field: DistanceField | BandedField, gradient: bool = False, otherwise: str = ELSEWHERE
) -> None:
    """Write `field` as the OpenVDB file `path`, 32-bit floats, placed by voxel size and origin in input units.

    udf      : the distances. Background: the band's half width, or the largest distance of a dense field, whose
               values are kept over the whole box. Signed distances are named sdf instead, a level set. Of a
               :class:`BandedField` only the blocks near the surface are in the file
    density  : fog to look at, ``clip(1 - |distance| / (2 cells), 0, 1)``, background 0
    gradient : (only if asked) vectors along which the distance grows, unit-free, by central differences; within a band
               zero for its last cell

    Raises :class:`MissingDependency` without OpenVDB, :class:`InputError` for cells smaller than it takes, for paths
    that are no text or do not end in .vdb, :class:`VADError` where the file cannot be written whole, which says what to
    do `otherwise`.
    """
    openvdb, path = load_openvdb(), ending_in(".vdb", path)
    try:
        os.fspath(path).encode()
    except UnicodeEncodeError as error:
        raise InputError(f"{path} holds bytes that are no text, which OpenVDB does not take; rename it") from error
    if field.spacing < _SMALLEST:
        raise InputError(
            f"cells are {field.spacing:.2g} wide, and OpenVDB takes none smaller than {_SMALLEST:g}; give the points "
            "in smaller units"
        )
    grids = _grids(openvdb, field, gradient)
    with atomic_path(path, otherwise) as temporary:
        openvdb.write(str(temporary), grids=grids, metadata={"creator": MADE_BY})
        if not _is_whole(temporary, len(grids)):
            raise VADError(f"{path} cannot be written whole (disk full?); free space there or {otherwise}")


def _grids(openvdb, field, gradient):
    if isinstance(field, BandedField):
        values, background = field.blocks, np.abs(field.blocks.outer).max()
    else:
        values = np.asarray(field.values, np.float32)
        background = field.band if np.isfinite(field.band) else values.max()
    fog = each(lambda u: np.clip(1 - np.abs(u) / np.float32(_FOG_CELLS * field.spacing), 0, 1), values)
    name = "sdf" if field.sdf else "udf"
    grids = [
        _grid(openvdb, field, openvdb.FloatGrid(float(np.float32(background))), name, values),
        _grid(openvdb, field, openvdb.FloatGrid(), "density", fog),
    ]
    if field.sdf:
        grids[0].gridClass = openvdb.GridClass.LEVEL_SET
    grids[1].gridClass = openvdb.GridClass.FOG_VOLUME
    if gradient:
        grids.append(_grid(openvdb, field, openvdb.Vec3SGrid(), "gradient", node_gradient(values, field.spacing)))
    return grids


def _grid(openvdb, field, grid, name, array):
    grid.name = name
    fill(grid, array)
    grid.transform = openvdb.createLinearTransform(voxelSize=float(field.spacing))
    grid.transform.postTranslate([float(x) for x in field.origin])
    return grid


def _is_whole(file, grids):
    """OpenVDB does not notice a full disk. A whole file ends where its last grid says it does.

    Layout: 57 bytes of preamble; the number of metadata and for each name, type and value; the number of grids and
    for each name, type, parent and three positions, of which the last is the grid's end.
    """

    def number(form):
        return struct.unpack(form, stream.read(struct.calcsize(form)))[-1]

    def skip_strings():
        for _ in range(3):
            stream.seek(number("<I"), os.SEEK_CUR)

    with open(file, "rb") as stream:
        try:
            stream.seek(57)
            for _ in range(number("<I")):
                skip_strings()
            if number("<I") != grids:
                return False
            for _ in range(grids):
                skip_strings()
                stream.seek(number("<3q"))
        except (struct.error, ValueError):  # cut off within a number; a position that was never filled in
            return False
        return stream.tell() == os.path.getsize(file)
