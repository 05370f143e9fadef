"""The field that a run left in its volume, as what it was made for: a new surface needs no new one then."""

import hashlib
import json
from pathlib import Path

import numpy as np

from ..core.errors import VADError
from ..core.field.grid import Grid
from ..core.io.openvdb_module import load_openvdb
from ..core.points import Samples
from ..core.settings import Settings

_MAKE_THE_FIELD = "resolution", "band", "bridge", "integration", "diffusion"  # of the settings


def identity(path: Path, points: np.ndarray, normals: np.ndarray, confidence: np.ndarray, settings: dict) -> str | None:
    """A text that is the same for samples (n,3), their normals (n,3) and confidence (n,) that give the same field with
    these settings, by name, and for a file at `path` as large as before: another may have taken its name. None where
    there is none."""
    if not path.is_file():
        return None
    digest = hashlib.sha256(json.dumps([path.stat().st_size, *(settings[name] for name in _MAKE_THE_FIELD)]).encode())
    for values in (points, normals, confidence):
        digest.update(np.ascontiguousarray(values, np.float32).tobytes())
    return digest.hexdigest()


def suffices(settings: Settings) -> bool:
    """Whether the distances in the whole box are all that these settings need: sides of sheets and blocks of a band are
    not in the file."""
    return settings.band is None and settings.surface in {"double", "none"}


def grid_of(path: Path, origin: np.ndarray, samples: Samples) -> Grid:
    """The grid that the file's field was made on, in the samples' unit frame, in whose middle it lies. `origin` (3,) is
    what the file's places are relative to. One fitted to the samples anew may have a node more or less along an axis:
    Blender rounds their positions.

    Raises :class:`VADError` where the file cannot be read.
    """
    place = _read(path, lambda openvdb, name: openvdb.readGridMetadata(str(path), name).transform)
    corner = (np.array(place.indexToWorld((0, 0, 0))) + origin - samples.centre) / samples.scale
    cell = place.voxelSize()[0] / samples.scale
    return Grid(corner, cell, tuple(int(n) for n in np.rint(-2 * corner / cell) + 1))


def distances(path: Path, shape: tuple[int, int, int]) -> np.ndarray:
    """(nx,ny,nz) float32 unsigned distances at the nodes, in input units, of a file that holds these or signed ones.

    Raises :class:`VADError` where the file cannot be read.
    """
    values = np.empty(shape, np.float32)
    _read(path, lambda openvdb, name: openvdb.read(str(path), name).copyToArray(values))
    return np.abs(values, out=values)


def _read(path, take):
    """What `take` takes of a file, given OpenVDB and the name of the grid of distances."""
    openvdb = load_openvdb()
    try:
        names = {grid.name for grid in openvdb.readAllGridMetadata(str(path))}
        return take(openvdb, "sdf" if "sdf" in names else "udf")
    except (OSError, LookupError, RuntimeError, ValueError) as error:
        raise VADError(f"{path} cannot be read ({error}): reconstruct again") from error
