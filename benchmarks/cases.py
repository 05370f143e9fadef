"""Point clouds with ground truth.

A case is a file `NAME.npz` with the arrays

points, normals       : (n,3), samples uniform by area and the true normals there
points_pd, normals_pd : (n,3), a blue-noise sampling of the same surface; may be missing
gt_v, gt_f            : (v,3) and (f,3), the true mesh
nm_curve              : (m,3), samples of the curves where sheets meet or cross; may be empty
meta                  : JSON text with at least `category`, `license` and `origin`

`python -m benchmarks.make_cases` makes such files.
"""

import json
import zipfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core import InputError, Mesh

SAMPLINGS = {"uniform": ("points", "normals"), "blue noise": ("points_pd", "normals_pd")}
SPOILED = {"noisy", "outliers", "holes", "wireframe"}  # categories whose points are no clean sampling of the surface
_TRUTH = ("gt_v", "gt_f", "nm_curve", "meta")


@dataclass(frozen=True)
class Case:
    """points, normals : (n,3) float64     truth : the true Mesh     nm_curve : (m,3) float64     meta : dict"""

    name: str
    points: np.ndarray
    normals: np.ndarray
    truth: Mesh
    nm_curve: np.ndarray
    meta: dict


def find_cases(folder: Path, names: list[str] | None = None) -> list[Path]:
    """Files of the cases called `names`, in that order, or of all in the folder. Raises :class:`InputError`."""
    files = {path.stem: path for path in sorted(folder.glob("*.npz"))}
    if not files:
        raise InputError(f"{folder} holds no .npz case; give the folder that does")
    unknown = [name for name in names or [] if name not in files]
    if unknown:
        raise InputError(f"no case is called {', '.join(unknown)}; {folder} holds {', '.join(files)}")
    return [files[name] for name in names or files]


def has_sampling(path: Path, sampling: str) -> bool:
    """Whether the case holds points of the sampling (a key of SAMPLINGS)."""
    with _opened(path) as arrays:
        return SAMPLINGS[sampling][0] in arrays


def count_points(path: Path, sampling: str) -> int:
    """How many points the case has in the sampling; 0 where it has none."""
    name = SAMPLINGS[sampling][0]
    with _opened(path) as arrays:
        return len(arrays[name]) if name in arrays else 0


def load_case(path: Path, sampling: str = "uniform") -> Case:
    """Read a case with the points of one sampling. Raises :class:`InputError` where the file is no case."""
    points, normals = SAMPLINGS[sampling]
    with _opened(path) as arrays:
        missing = [name for name in (points, normals, *_TRUTH) if name not in arrays]
        if missing:
            raise InputError(f"{path} lacks {', '.join(missing)}; a {sampling} case needs these arrays")
        return Case(
            path.stem,
            arrays[points].astype(float),
            arrays[normals].astype(float),
            Mesh(arrays["gt_v"].astype(float), arrays["gt_f"].astype(np.int32)),
            arrays["nm_curve"].astype(float),
            json.loads(str(arrays["meta"])),
        )


@contextmanager
def _opened(path):
    """The arrays of the file, read as they are asked for."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            yield arrays
    except InputError:
        raise
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} cannot be read as .npz ({error}); take it out of the folder") from error
