"""What runs were said to cost before they began, and what they took."""

from pathlib import Path

import numpy as np

from core import Settings, reconstruct
from core.budget import crowded_share, estimate_cost
from core.cleaning.noise import looks_noisy
from core.field.grid import fit_grid
from core.memory import peak_memory_mb
from core.points import local_spacing, prepare_samples

from .cases import load_case
from .peers import Clock
from .processes import run_fresh

WITHIN = 0.4  # of what a run takes, that the estimate may be off
EVERY = (("uniform", Settings()), ("uniform", Settings(surface="both")), ("blue noise", Settings()))
SOME = (  # for one case
    ("uniform", Settings(surface="single", resolution=256)),
    ("uniform", Settings(surface="both", resolution=256, band=4)),
    ("uniform", Settings(resolution=512, band=4)),
)


def cost(path: Path, sampling: str, settings: Settings) -> dict:
    """Estimates of `python -m core info` and what one run took, in a process of its own."""
    return run_fresh(_cost, path, sampling, settings)


def _cost(path, sampling, settings):
    points = load_case(path, sampling).points
    samples = prepare_samples(points)
    spacing, grid = local_spacing(samples.points), fit_grid(samples.points, settings.resolution)
    looks = looks_noisy(samples.points, spacing), crowded_share(samples.points, spacing)
    said = estimate_cost(spacing, grid, settings, *looks)
    before = peak_memory_mb()
    with Clock() as clock:
        reconstruct(points, settings)
    return {
        "case": path.stem,
        "sampling": sampling,
        "surface": settings.surface,
        "resolution": settings.resolution,
        "band": settings.band,
        "cpu_said": said.cpu_seconds,
        "cpu": clock.cpu,
        "seconds_said": said.seconds,
        "seconds": clock.seconds,
        "memory_said": said.memory_mb,
        "memory": peak_memory_mb() - before,
    }


def ratios(rows: list[dict]) -> dict[str, np.ndarray]:
    """Said over taken, of processor time and of memory."""
    return {key: np.array([row[f"{key}_said"] / row[key] for row in rows]) for key in ("cpu", "memory")}
