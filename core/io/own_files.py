"""Which files this program made, as it tells them from a user's own of the same name."""

from pathlib import Path

from .report import report_of

MADE_BY = "made by VAD (Voronoi-Assisted Diffusion)"
_STARTS = {".ply": MADE_BY, ".vdb": MADE_BY, ".npz": "values.npy"}  # what is near the start of each
_START = 1 << 10  # bytes


def is_own(path: Path) -> bool:
    """Whether the .ply, .vdb, .npz or .json file `path` was made by this program, by what it holds."""
    if path.suffix == ".json":
        return bool(report_of(path))
    with open(path, "rb") as file:
        return _STARTS[path.suffix].encode() in file.read(_START)
