"""Seconds of the two stages at the sizes of the paper's table, beside the seconds it publishes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core import Settings
from core.field.grid import fit_grid
from core.field.integration import distance_field
from core.field.local_surface import fit_local_surface
from core.memory import peak_memory_mb
from core.normals.estimate import estimate_normals
from core.points import local_spacing, prepare_samples

from .cases import load_case
from .geometry import surface_points
from .peers import Clock
from .processes import run_fresh

# Table "Runtime performance" of the paper: Core i9-10900, RTX 4090
PUBLISHED_NORMALS = {1_000: 1.906, 5_000: 2.21, 15_000: 9.85, 100_000: 56.20}
PUBLISHED_FIELD = {
    32: {1_000: 0.46, 5_000: 1.95, 15_000: 3.64, 100_000: 32.38},
    64: {1_000: 5.32, 5_000: 11.56, 15_000: 28.85, 100_000: 226.92},
    128: {1_000: 40.10, 5_000: 119.26, 15_000: 234.70, 100_000: 1742.93},
    256: {1_000: 351.51, 5_000: 799.37, 15_000: 1731.03},
}


def costs(path: Path) -> Iterator[dict]:
    """:func:`cost` for every size of the paper's table, each in a process of its own."""
    for count in PUBLISHED_NORMALS:
        for resolution in PUBLISHED_FIELD:
            yield run_fresh(cost, path, count, resolution)


def cost(path: Path, count: int, resolution: int) -> dict:
    """Wall-clock and CPU seconds of the normals and of the field (patches, diffusion and integration) on `count` points
    of the case's true surface, in a cube of `resolution` cells along its longest side; peak memory of the process."""
    case = load_case(path)
    samples = prepare_samples(surface_points(case.truth, count, np.random.default_rng(0)))
    spacing, settings = local_spacing(samples.points), Settings(resolution=resolution)
    with Clock() as normals:
        axes, confidence, _ = estimate_normals(samples.points, spacing, settings)
    with Clock() as field:
        surface = fit_local_surface(samples.points, axes, confidence, spacing, settings.bridge)
        values, _ = distance_field(surface, fit_grid(samples.points, resolution))
    return {
        "points": count,
        "resolution": resolution,
        "nodes": values.size,
        "normals": {"seconds": normals.seconds, "cpu": normals.cpu},
        "field": {"seconds": field.seconds, "cpu": field.cpu},
        "peak_memory_mb": peak_memory_mb(),
    }
