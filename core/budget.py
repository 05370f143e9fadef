"""What a run will cost, before it starts."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from .errors import MemoryBudgetError
from .field.grid import Grid
from .settings import WITH_SIDES, Settings, options

FREE_SHARE = 0.7  # of the free memory, where no limit is set

# Measured on runs with default settings over 1,000 to 300,000 samples, resolutions of 64 to 320.
_MEMORY = {"diagram": 15.0, "sample": 2.2e-3, "field": 130.0, "node": 46e-6}  # MiB
_SECONDS = {"fixed": 0.3, "sample": 8e-5, "near": 9e-6, "node": 4e-7}  # where the probe takes _PROBE

# The same in a band, at resolutions of 256 and 512: by squared cells of the surface, with sides told apart or not.
_BAND_MEMORY = {"field": 110.0, "surface": 1.9e-3, "surface with sides": 3.6e-3}  # MiB
_BAND_NEAR = 3.4, 1 / 8  # cells from the surface that all nodes are projected in, and share of the others that is
_BAND_SECONDS = 2e-6  # for a node further out
_PROBE = 0.006
_NEAR = 2.9  # cells from the surface, besides a spacing, up to which nodes are projected onto it


@dataclass(frozen=True)
class Estimate:
    """Wall seconds on this machine as busy as it is now, and the most memory held at a time, MiB."""

    seconds: float
    memory_mb: float


def estimate_cost(spacing: np.ndarray, grid: Grid, settings: Settings = Settings()) -> Estimate:
    """Cost of a run over clean samples with local spacing (n,), in the units of the grid. Of the settings only the
    resolution, the band and, within a band, the kind of surface count.

    The area of the surface, which is about the sum of the squared spacings, tells how many nodes lie near it.
    """
    cells = spacing / grid.spacing
    work = _SECONDS["fixed"] + _SECONDS["sample"] * len(spacing)
    if settings.band is None:
        nodes = float(np.prod(grid.shape))
        near = 2.0 * float(np.sum(cells**2 * (_NEAR + cells)))
        work += _SECONDS["near"] * near + _SECONDS["node"] * nodes
        memory = _MEMORY["field"] + _MEMORY["node"] * nodes
    else:
        area, (width, share) = float(np.sum(cells**2)), _BAND_NEAR
        near = 2.0 * float(np.sum(cells**2 * (width + share * (_NEAR + cells))))
        work += _SECONDS["near"] * near + _BAND_SECONDS * 2.0 * area * settings.band
        kind = "surface with sides" if settings.surface in WITH_SIDES else "surface"
        memory = _BAND_MEMORY["field"] + _BAND_MEMORY[kind] * area
    return Estimate(work * _probe() / _PROBE, max(memory, _diagram(len(spacing))))


def check_budget(estimate: Estimate, samples: int, grid: Grid, settings: Settings) -> None:
    """Raise :class:`MemoryBudgetError` where the memory estimated is beyond the limit; the message says what fits."""
    limit = settings.memory_limit
    if limit == "auto":
        limit = FREE_SHARE * free_memory_mb()
    if estimate.memory_mb <= limit:
        return
    least = options()["resolution"].metadata["limits"][0]
    finer = range(settings.resolution - 1, least - 1, -1)
    fitting = (r for r in finer if max(_diagram(samples), _at(r, estimate, grid, settings)) <= limit)
    if resolution := next(fitting, None):
        band = ", set band to 4" if settings.band is None and settings.integration == "transport" else ""
        remedy = f"use resolution {resolution} or less{band}, or raise memory_limit"
    else:
        fitting = max(0, int((limit - _MEMORY["diagram"]) / _MEMORY["sample"]))
        remedy = f"thin the {samples} points to {fitting} or fewer, or raise memory_limit"
    raise MemoryBudgetError(
        f"resolution {settings.resolution} needs about {estimate.memory_mb:.0f} MiB; "
        f"{limit:.0f} MiB may be used; {remedy}"
    )


def free_memory_mb() -> float:
    """Memory that this process can still get without swapping, MiB; in a container, within its limit."""
    if sys.platform == "linux":
        return min(_linux_available(), _container_left())
    return (_windows_available if sys.platform == "win32" else _mac_available)()


def _diagram(samples):
    """MiB of the Voronoi diagram, which is gone before the grid is filled: the larger of the two counts."""
    return _MEMORY["diagram"] + _MEMORY["sample"] * samples


def _at(resolution, estimate, grid, settings):
    """MiB of the field at another resolution."""
    ratio = resolution / settings.resolution
    if settings.band is not None:
        return _BAND_MEMORY["field"] + (estimate.memory_mb - _BAND_MEMORY["field"]) * ratio**2
    nodes = np.prod(np.ceil((np.array(grid.shape) - 1) * ratio) + 2)
    return _MEMORY["field"] + _MEMORY["node"] * nodes


def _probe():
    """Seconds that a small fixed piece of the usual work takes here and now; the best of three."""
    points = np.random.default_rng(0).random((4000, 3))
    took = []
    for _ in range(3):
        start = time.perf_counter()
        distance, index = KDTree(points).query(points, k=16, workers=-1)
        np.exp(-np.einsum("nki,nki->nk", points[index], points[index]) * distance).sum()
        took.append(time.perf_counter() - start)
    return min(took)


def _linux_available():
    lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
    return int(lines["MemAvailable"].split()[0]) / 2**10


def _container_left():
    """MiB left in the control group (version 2 or 1), infinite where there is none."""
    folders = {"/sys/fs/cgroup": ("memory.max", "memory.current")}
    folders["/sys/fs/cgroup/memory"] = ("memory.limit_in_bytes", "memory.usage_in_bytes")
    for folder, (limit, used) in folders.items():
        limit, used = Path(folder, limit), Path(folder, used)
        if limit.exists() and used.exists() and limit.read_text().strip() != "max":
            return (int(limit.read_text()) - int(used.read_text())) / 2**20
    return float("inf")


def _mac_available():
    import re
    import subprocess

    text = subprocess.run(["/usr/bin/vm_stat"], capture_output=True, text=True, check=True).stdout
    page = int(re.search(r"page size of (\d+)", text).group(1))
    counts = [int(re.search(rf"Pages {name}:\s+(\d+)", text).group(1)) for name in ("free", "inactive", "speculative")]
    return page * sum(counts) / 2**20


def _windows_available():
    import ctypes

    class Status(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong)]
        _fields_ += [(name, ctypes.c_ulonglong) for name in ("total", "free", "d", "e", "f", "g", "h")]

    status = Status(length=ctypes.sizeof(Status))
    ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
    return status.free / 2**20
