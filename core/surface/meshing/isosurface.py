"""Iso-surfaces of a grid of values, by OpenVDB where it is found, else by scikit-image."""

import numpy as np

from ...errors import MissingDependency
from ...field.blocks import Blocks
from ...io.openvdb_module import fill, load_openvdb
from ...settings import WHOLE_BOX


def isosurface(values: np.ndarray | Blocks, level: float) -> tuple[np.ndarray, np.ndarray]:
    """The surface where `values` (nx,ny,nz) float32 equals `level`, normals towards larger values; closed where it
    meets the box, beyond which the largest value holds.

    Returns vertices (v,3) float64 in grid coordinates (cells) and faces (f,4) or (f,3) int64: quads from OpenVDB's
    dual contouring, closed and edge-manifold, or triangles from scikit-image's marching cubes, of whole boxes only.
    Raises :class:`MissingDependency` where neither library is found.
    """
    try:
        openvdb = load_openvdb()
    except MissingDependency as error:
        if isinstance(values, Blocks):
            raise MissingDependency(
                f"a surface from a band needs OpenVDB: {error}; or set band to none, with a resolution of {WHOLE_BOX} "
                "at most, or surface to none"
            ) from error
        return _by_marching_cubes(values, level)
    beyond = values.outer.max() if isinstance(values, Blocks) else values.max()
    grid = openvdb.FloatGrid(background=float(beyond))
    fill(grid, values)
    vertices, quads = grid.convertToQuads(isovalue=float(level))
    return vertices.astype(np.float64), quads.astype(np.int64)


def need_quads() -> None:
    """Raises :class:`MissingDependency` where :func:`isosurface` would give triangles."""
    try:
        load_openvdb()
    except MissingDependency as error:
        raise MissingDependency(f"quads need OpenVDB: {error}; or set faces to triangles") from error


def _by_marching_cubes(values, level):
    try:
        from skimage.measure import marching_cubes
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "a surface needs OpenVDB or scikit-image and neither is installed; run inside Blender, "
            "`pip install scikit-image`, or set surface to none"
        ) from error
    padded = np.pad(values, 1, constant_values=values.max())
    vertices, faces, _, _ = marching_cubes(padded, level, gradient_direction="descent", allow_degenerate=False)
    return vertices.astype(np.float64) - 1, faces.astype(np.int64)
