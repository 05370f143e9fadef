"""Points from files."""

import os

import numpy as np

from ..errors import InputError, MissingDependency
from .paths import path_of
from .read_numpy import read_npy, read_npz
from .read_text import read_obj, read_text


def _read_ply(path):
    """Imported when needed: Blender has no plyfile, and reads .ply files itself."""
    try:
        from .read_ply import read_ply
    except ModuleNotFoundError as error:
        raise MissingDependency(f"{path} needs plyfile, which is not installed; `pip install plyfile`") from error
    return read_ply(path)


def _bare(read):
    """A reader of points as one of points and attributes, of which it finds none."""
    return lambda path: (read(path), {})


READERS = {
    ".ply": _read_ply,
    ".xyz": read_text,
    ".pts": read_text,
    ".txt": read_text,
    ".csv": read_text,
    ".npy": _bare(read_npy),
    ".npz": _bare(read_npz),
    ".obj": _bare(read_obj),
}
_NORMALS = "nx", "ny", "nz"


def read_points(path: str | os.PathLike) -> np.ndarray:
    """Read the points of a scan, (n,3) float64 in the file's units, n >= 1.

    .ply                    : x, y, z of the vertices; ascii, with all digits, or binary, with or without faces
    .xyz, .pts, .txt, .csv  : a point a line, split by blanks, commas or semicolons; decimals after a comma where
                              something else parts the numbers; comments after # or //. A first line may name the
                              columns, x, y and z among them (three of which none says something else may have other
                              names), or number them from 0 with more than blanks between, or be the number of
                              points that follow, after which there may be more such blocks
    .npy, .npz              : an (n,3) array (of a .npz: the one called `points`, else the only one of that shape)
    .obj                    : the v lines

    Further columns and properties are ignored; rows with NaN or infinite coordinates are kept. Raises
    :class:`InputError` for anything else, before memory is taken for what the file does not hold, and
    :class:`MissingDependency` for .ply without plyfile.
    """
    return read_scan(path)[0]


def read_scan(path: str | os.PathLike) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The points, as :func:`read_points` reads them, and their attributes by name, (n,) each.

    .ply                    : every property of the vertices that is one number (red, green, blue, intensity, ...), as
                              stored
    .xyz, .pts, .txt, .csv  : every further column with a name and a number in each row, float64, colours up to 255
                              uint8. Without names: in .pts files of four or seven columns intensity, red, green and
                              blue; else red, green and blue where three whole numbers up to 255 follow the coordinates
                              in every row

    Normals are left out: they belong to the surface the points came from.
    """
    path = path_of(path)
    try:
        read = _reader(path)
        points, attributes = read(path)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror or error}); check path and permissions") from error
    if not len(points):
        raise InputError(f"{path} holds no points")
    carried = {name: values for name, values in attributes.items() if name not in _NORMALS}
    return np.ascontiguousarray(points, np.float64), carried


def _reader(path):
    known = ", ".join(READERS)
    size = path.stat().st_size
    if not path.is_file():
        raise InputError(f"{path} is not a file; give one of {known}")
    if path.suffix.lower() not in READERS:
        raise InputError(f"{path} has the extension {path.suffix!r}; known are {known}")
    if size == 0:
        raise InputError(f"{path} is empty")
    return READERS[path.suffix.lower()]
