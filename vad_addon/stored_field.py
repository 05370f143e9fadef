"""The field that a run left in its volume, as what it was made for: a new surface needs no new one then."""

import hashlib
import json
from pathlib import Path

import numpy as np

from ..core.errors import VADError
from ..core.io.openvdb_module import load_openvdb
from ..core.settings import Settings

_MAKE_THE_FIELD = "resolution", "band", "bridge", "integration", "diffusion"  # of the settings


def identity(points: np.ndarray, normals: np.ndarray, confidence: np.ndarray, settings: dict) -> str:
    """A text that is the same for samples (n,3), their normals (n,3) and confidence (n,) that give the same field with
    these settings, by name."""
    digest = hashlib.sha256(json.dumps([settings[name] for name in _MAKE_THE_FIELD]).encode())
    for values in (points, normals, confidence):
        digest.update(np.ascontiguousarray(values, np.float32).tobytes())
    return digest.hexdigest()


def suffices(settings: Settings) -> bool:
    """Whether the distances in the whole box are all that these settings need: sides of sheets and blocks of a band are
    not in the file."""
    return settings.band is None and settings.surface in {"double", "none"}


def distances(path: Path, shape: tuple[int, int, int]) -> np.ndarray:
    """(nx,ny,nz) float32 unsigned distances at the nodes, in input units, of a file that holds these or signed ones.

    Raises :class:`VADError` where the file cannot be read.
    """
    values, openvdb = np.empty(shape, np.float32), load_openvdb()
    try:
        names = {grid.name for grid in openvdb.readAllGridMetadata(str(path))}
        openvdb.read(str(path), "sdf" if "sdf" in names else "udf").copyToArray(values)
    except (OSError, LookupError, RuntimeError, ValueError) as error:
        raise VADError(f"{path} cannot be read ({error}): reconstruct again") from error
    return np.abs(values, out=values)
