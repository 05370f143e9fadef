"""Points from NumPy's own files; nothing is ever unpickled."""

import math
import tokenize
import zipfile
import zlib
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import InputError

MAX_UNPACKED = 2 * 2**30  # bytes of one array in a .npz: 89 million points of float64

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
_PACKED = (zipfile.lzma.LZMAError,) if zipfile.lzma else ()  # not every Python has that module
_DAMAGE = (
    *_PACKED,
    ValueError,
    EOFError,
    SyntaxError,
    RuntimeError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


def read_npy(path: Path) -> np.ndarray:
    """The first three columns of an (n,3+) array of real numbers, (n,3)."""
    with _named(path), path.open("rb") as file:
        return _read_array(file, path.stat().st_size)


def read_npz(path: Path) -> np.ndarray:
    """The same of the array `points` in a .npz, or of the only (n,3) array in it."""
    with _named(path), zipfile.ZipFile(path) as archive:
        sizes = {info.filename: info.file_size for info in archive.infolist() if info.filename.endswith(".npy")}
        name = "points.npy" if "points.npy" in sizes else _only_triples(archive, sizes)
        if sizes[name] > MAX_UNPACKED:
            raise ValueError(f"{name} unpacks to {sizes[name]} bytes; at most {MAX_UNPACKED} are read, or save a .npy")
        with archive.open(name) as member:
            return _read_array(member, sizes[name])


@contextmanager
def _named(path):
    try:
        yield
    except _DAMAGE as error:
        raise InputError(f"{path} cannot be used: {error}") from error


def _header(stream: BinaryIO):
    version = np.lib.format.read_magic(stream)
    if version not in _HEADERS:
        raise ValueError(f"its format version is {version}; save it as a plain array of numbers")
    shape, _, dtype = _HEADERS[version](stream)
    return shape, dtype


def _read_array(stream, size):
    shape, dtype = _header(stream)
    if dtype.hasobject:
        raise ValueError("it holds pickled Python objects, which are never loaded; save a plain array of numbers")
    if dtype.kind not in "fiu" or len(shape) != 2 or shape[0] < 0 or shape[1] < 3:
        raise ValueError(f"its array has shape {shape} and type {dtype}; an (n,3) array of real numbers is needed")
    claimed, held = math.prod(shape) * dtype.itemsize, size - stream.tell()
    if claimed > held:
        raise ValueError(f"its header claims {claimed} bytes of shape {shape}, but {held} follow; is it cut off?")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)[:, :3]


def _only_triples(archive, names):
    shapes = {}
    for name in names:
        with archive.open(name) as member:
            shapes[name] = _header(member)[0]
    triples = [name for name, shape in shapes.items() if len(shape) == 2 and shape[1] == 3]
    if len(triples) != 1:
        held = ", ".join(f"{name.removesuffix('.npy')} {shape}" for name, shape in shapes.items()) or "no array"
        raise ValueError(f"it holds {held}; name the (n,3) array to use 'points'")
    return triples[0]
