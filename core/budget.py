"""What a run will cost, before it starts."""

import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from .cleaning.anchors import some_samples
from .errors import MemoryBudgetError
from .field.grid import Grid, fit_grid
from .linalg import row_dots
from .neighbourhoods.quadrics import nested_residuals
from .normals.energy_torch import uses_torch
from .parallel import cores
from .points import MINIMUM_SAMPLES
from .settings import BESIDE_OFFSET, Settings, options

_CGROUP = Path("/sys/fs/cgroup")
_FREE_SHARE = 0.7  # of the free memory, where no limit is set
SUITED = 1.5  # cells between points that show their detail; see docs/scale.md
_BAND = 4.0  # cells, the band that is advised at least

# Fitted to runs over 100 to 400,000 samples at resolutions of 64 to 512, in a band or not. Of 84 in the whole box over
# 3,000 samples and more each held .72 to 1.18 times as much, nine tenths of them .79 to 1.09: the Voronoi diagram by
# samples, the field by nodes, the meshes by nodes and by squared cells of the surface, in a band both by the latter,
# and both beside what is known of each sample. One is over before the next begins.
_MEMORY = {"diagram": 33.0, "sample": 1.5e-3, "field": 20.0, "node": 31e-6, "meshes": 52.0, "held node": 2.2e-6}  # MiB
_SQUARED_CELL, _HELD_SAMPLE = 4.6e-3, 0.7e-3  # MiB
_BAND_MEMORY = {"field": 110.0, "surface": 3.4e-3}  # MiB
_ENERGY = {"sample": 31e-3, "torch": 180.0}  # MiB, with the solver of that name: by samples, and for that library
_POISSON_NODE = 40e-6  # MiB
_CORE = 15.0  # MiB that each core beyond two holds in chunks

# Processor seconds where the probe takes _PROBE of them; fitted to 234 runs over 100 to 200,000 samples at resolutions
# of 64 to 384, nine tenths of which took .67 to 2.9 times as much, most of the others slices and torn shapes. The field
# is worked out at the nodes next to the surface, as many for each squared cell of it however far its samples are apart;
# in a band at more of them.
_FIXED, _SAMPLE, _NOISY_SAMPLE, _NODE = 0.35, 1.0e-4, 1.5e-4, 1.0e-7
_BY_ENERGY, _BY_POISSON = 9.0e-4, 6.0e-7  # more for a sample with that solver, for a node with that integration
_FIELD, _BAND_FIELD, _MESHES = 1.4e-5, 6.5e-5, 2.2e-5  # for a squared cell of the surface
_CROWDED = {"none": 0.0, "double": 1.0, "single": 1.7, "both": 1.7, "signed": 1.7}  # times the work, by that share
_LOOKED_AT, _NEIGHBOURS = 500, 24  # samples, and those nearest to each
_OFF = 0.25  # local spacings, that these are off the quadric through them where sheets run close
_PROBE = 0.0045
_CORES = 0.9  # seconds by the clock for one of the processor, where two cores or more are free


@dataclass(frozen=True)
class Estimate:
    """Seconds on this machine as busy as it is now, the most memory held at a time, MiB, and seconds of the processor,
    all cores together, which other work hardly changes."""

    seconds: float
    memory_mb: float
    cpu_seconds: float


def estimate_cost(
    spacing: np.ndarray, grid: Grid, settings: Settings = Settings(), noisy: bool = False, crowded: float = 0.0
) -> Estimate:
    """Cost of a run over samples with local spacing (n,), in the units of the grid. Of the settings band, surface,
    denoise, solver and integration count, and for the memory the backend, whose time is taken as NumPy's.

    noisy   : whether the samples look noisy; counts where `denoise` is "auto"
    crowded : share of them where sheets run close, see :func:`crowded_share`; counts for clean ones alone

    The area of the surface, about the sum of the squared spacings, tells how many nodes lie near it.
    """
    cells, nodes = spacing / grid.spacing, float(np.prod(grid.shape))
    area, noisy = float(np.sum(cells**2)), noisy if settings.denoise == "auto" else settings.denoise > 0
    work = _FIXED + (_SAMPLE + noisy * _NOISY_SAMPLE) * len(spacing) + area * _MESHES * (settings.surface != "none")
    work += area * _FIELD + nodes * _NODE if settings.band is None else area * _BAND_FIELD
    work *= 1 + _CROWDED[settings.surface] * crowded * (not noisy)
    work += _BY_ENERGY * len(spacing) * (settings.solver == "energy")
    work += _BY_POISSON * nodes * (settings.integration == "poisson")
    probe, busy = _probe()
    cpu = work * probe / _PROBE
    return Estimate(_CORES * busy * cpu, _memory(len(spacing), area, nodes, settings), cpu)


def crowded_share(points: np.ndarray, spacing: np.ndarray) -> float:
    """Share of samples (n,3) with local spacing (n,), in the same units, whose neighbours lie off any one quadric, as
    those of sheets that run close do: such sheets are told apart in several ways, which takes time. Of 500 samples, or
    all. Noise looks like that, too."""
    rows = some_samples(points, min(_LOOKED_AT, len(points)), 0)
    (found,) = nested_residuals(points, rows, (min(_NEIGHBOURS, len(points)),))
    return float((found.level > _OFF * spacing[rows]).mean())


def suited_resolution(points: np.ndarray, spacing: np.ndarray) -> int:
    """The resolution, within its limits, at which samples (n,3), or the corners of the box around them, with local
    spacing (n,), lie a cell and a half apart in the median. Coarser grids lose some of what points show, most where
    sheets run close; finer ones show hardly more (measured in docs/scale.md)."""
    low, high = options()["resolution"].metadata["limits"]
    resolution = SUITED * low * fit_grid(points, low).spacing / np.median(spacing)
    return round(float(np.clip(resolution, low, high)))


def check_budget(estimate: Estimate, spacing: np.ndarray, grid: Grid, settings: Settings) -> tuple[str, ...]:
    """A warning where the memory estimated for samples with local spacing (n,), in the units of the grid, is beyond
    half of the limit; raises :class:`MemoryBudgetError` where it is beyond the limit, with a message that says what
    fits."""
    limit = settings.memory_limit
    if limit == "auto":
        limit = _FREE_SHARE * free_memory_mb()
    if estimate.memory_mb <= 0.5 * limit:
        return ()
    if estimate.memory_mb <= limit:
        return (f"estimated at {estimate.memory_mb:.0f} MiB, of {limit:.0f} MiB that may be used",)
    area = float(np.sum((spacing / grid.spacing) ** 2))
    resolutions, fitting = range(settings.resolution, settings.coarsest - 1, -1), _fitting_samples(limit, settings)

    def finest(samples):
        return next((r for r in resolutions if _memory_at(r, samples, area, grid, settings) <= limit), None)

    if resolution := finest(len(spacing)):
        band = _fitting_band(len(spacing), area, limit, settings)
        remedy = f"use resolution {resolution} or less{band}, or raise memory_limit"
    elif len(spacing) > fitting >= MINIMUM_SAMPLES and (resolution := finest(fitting)):
        coarser = "" if resolution == settings.resolution else f" and use resolution {resolution} or less"
        remedy = f"thin the {len(spacing)} points to {fitting} or fewer{coarser}, or raise memory_limit"
    elif _memory_at(options()["resolution"].metadata["limits"][0], len(spacing), area, grid, settings) <= limit:
        remedy = "lower the offset, which a coarser grid has no room for, or raise memory_limit"
    else:
        remedy = "raise memory_limit"
    raise MemoryBudgetError(
        f"resolution {settings.resolution} needs about {estimate.memory_mb:.0f} MiB; "
        f"{limit:.0f} MiB may be used; {remedy}"
    )


def advised_band(offset: float) -> float:
    """Cells of a band that holds what is mostly needed of the field, for a cover at `offset` cells."""
    return max(_BAND, offset + BESIDE_OFFSET)


def free_memory_mb() -> float:
    """Memory that this process can still get without swapping, MiB; in a container, within its limit."""
    if sys.platform == "linux":
        return min(_linux_available(), _container_left())
    return (_windows_available if sys.platform == "win32" else _mac_available)()


def _memory(samples, area, nodes, settings):
    """MiB of a run over a surface of `area` squared cells: of its most costly stage."""
    least, each = _by_samples(settings)
    diagram, held = least + each * samples, _HELD_SAMPLE * samples
    if settings.band is not None:
        return _by_cores() + max(diagram, _BAND_MEMORY["field"] + _BAND_MEMORY["surface"] * area + held)
    node = _POISSON_NODE if settings.integration == "poisson" else _MEMORY["node"]
    field = _MEMORY["field"] + node * nodes
    meshes = _MEMORY["meshes"] + _MEMORY["held node"] * nodes + _SQUARED_CELL * area
    return _by_cores() + max(diagram, held + max(field, meshes * (settings.surface != "none")))


def _by_cores():
    """MiB that all stages take for the cores there are."""
    return _CORE * max(0, cores() - 2)


def _by_samples(settings):
    """MiB that normals take for any samples, and for each of them."""
    if settings.solver != "energy":
        return _MEMORY["diagram"], _MEMORY["sample"]
    return _MEMORY["diagram"] + _ENERGY["torch"] * uses_torch(settings), _ENERGY["sample"]


def _fitting_samples(limit, settings):
    """How many samples normals can be found of within `limit` MiB."""
    least, each = _by_samples(settings)
    return max(0, int((limit - _by_cores() - least) / each))


def _memory_at(resolution, samples, area, grid, settings):
    """MiB of a run at another resolution than that of the grid."""
    ratio = resolution / settings.resolution
    nodes = float(np.prod(np.ceil((np.array(grid.shape) - 1) * ratio) + 2))
    return _memory(samples, area * ratio**2, nodes, settings)


def _fitting_band(samples, area, limit, settings):
    """The advice to set a band, where that is possible and fits."""
    if settings.band is not None or settings.integration != "transport":
        return ""
    in_band = replace(settings, band=advised_band(settings.offset))
    return f", set band to {in_band.band:g}" if _memory(samples, area, 0, in_band) <= limit else ""


def _probe():
    """Processor seconds of a small fixed piece of the usual work, the least of three, and how many times as long the
    three took by the clock as of the processor, which other work on the machine makes more. Where the processor's
    seconds are counted in larger pieces than that, as on Windows, both by the clock."""
    points = np.random.default_rng(0).random((1500, 3))
    times = [(time.perf_counter(), time.thread_time())]
    for _ in range(3):
        distance, index = KDTree(points).query(points, k=16)
        np.exp(-row_dots(points[index], points[index]) * distance).sum()
        times.append((time.perf_counter(), time.thread_time()))
    by_clock, of_processor = np.diff(times, axis=0).T
    if not of_processor.min() > 0:
        return by_clock.min(), by_clock.mean() / by_clock.min()
    return of_processor.min(), max(1.0, by_clock.sum() / of_processor.sum())


def _linux_available():
    lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
    return int(lines["MemAvailable"].split()[0]) / 2**10


def _container_left():
    """MiB left in the control group (version 2 or 1), infinite where there is none. Of what it uses, file pages not
    touched for a while are given up when others are asked for."""
    version_2 = _CGROUP, "memory.max", "memory.current", "inactive_file"
    version_1 = _CGROUP / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
    for folder, *files, given_up in (version_2, version_1):
        limit, used, stat = (folder / name for name in (*files, "memory.stat"))
        if limit.exists() and used.exists() and limit.read_text().strip() != "max":
            pages = dict(line.split() for line in stat.read_text().splitlines()) if stat.exists() else {}
            return (int(limit.read_text()) - int(used.read_text()) + int(pages.get(given_up, 0))) / 2**20
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
