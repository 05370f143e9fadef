"""Which files this program made, as it tells them from a user's own of the same name."""

from pathlib import Path
from zipfile import BadZipFile, ZipFile

from .report import report_of

MADE_BY = "made by VAD (Voronoi-Assisted Diffusion)"
_ARRAYS = {"values.npy", "origin.npy", "node.npy", "foot.npy"}  # in each .npz, among others
_START = 1 << 10  # bytes of a .ply or .vdb, that say it


def is_own(path: Path) -> bool:
    """Whether the .ply, .vdb, .npz or .json file `path` was made by this program, by what it holds. Folders and pipes,
    which nothing may ever come out of, were not."""
    if not path.is_file():
        return False
    if path.suffix == ".json":
        return bool(report_of(path))
    if path.suffix == ".npz":
        try:
            with ZipFile(path) as archive:
                return set(archive.namelist()) >= _ARRAYS
        except BadZipFile:
            return False
    with open(path, "rb") as file:
        return MADE_BY.encode() in file.read(_START)
