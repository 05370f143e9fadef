"""The field as plain arrays, for other programs to extract surfaces from."""

import os
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from ..field.blocks import node_gradient
from ..field.distance_field import BandedField
from ..linalg import unit
from ..reconstruction import Reconstruction
from .atomic import atomic_path
from .paths import ending_in


def write_arrays(path: str | os.PathLike, result: Reconstruction) -> None:
    """Write the field of `result` as the NumPy archive `path`, for ``numpy.load(path, allow_pickle=False)``:

    values    : (nx,ny,nz) float32, distances in input units; node (i,j,k) lies at ``origin + spacing * (i,j,k)``
    origin    : (3,) float64     spacing : float64, one cell     signed : bool, whether values are negative inside
    gradient  : (nx,ny,nz,3) float32, unit-free, of `values` by central differences; at nodes next to the surface of an
                unsigned field these see both of its sides, use `direction` there
    node      : (b,3) int32, indices (i,j,k) of the nodes within two cells of the surface
    direction : (b,3) float32, there the unit direction away from the surface: the fused direction field, signed, that
                the distance grows along; zero at nodes on the surface
    foot      : (b,3) float64, the point of the surface that the distance is measured to

    Of a field in a band there are, in place of the first two, blocks of 8^3 nodes; nodes elsewhere are further from the
    surface than `band`. At the sides of the box blocks reach past `shape`; entries there mean nothing, so cut them off:

    block     : (k,3) int32, indices (i,j,k) of the lowest node of each     shape : (3,) int64, nodes of the whole box
    values    : (k,8,8,8) float32                                           band  : float64, its half width
    gradient  : (k,8,8,8,3) float32, zero within a cell of the band's end

    Raises :class:`InputError` for paths that do not end in .npz, :class:`VADError` where the file cannot be written
    whole.
    """
    path, field, near = ending_in(".npz", path), result.field, result.field.near
    node = np.stack(np.unravel_index(near.node, field.shape), axis=1)
    if isinstance(field, BandedField):
        gradient = node_gradient(field.blocks, field.spacing).stored
        values = dict(values=field.blocks.stored, block=field.blocks.corners().astype(np.int32))
        values |= dict(shape=field.shape, band=field.band)
    else:
        values, gradient = dict(values=field.values), node_gradient(field.values, field.spacing)
    arrays = values | dict(
        origin=field.origin,
        spacing=field.spacing,
        signed=field.sdf,
        gradient=gradient,
        node=node.astype(np.int32),
        direction=unit(near.step).astype(np.float32),
        foot=field.origin + field.spacing * node - near.step,
    )
    with atomic_path(path) as temporary, ZipFile(temporary, "w", ZIP_DEFLATED) as archive:
        for name, array in arrays.items():  # numpy.savez would leave the archive open where the disk is full
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)
