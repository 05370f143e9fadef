"""Stray samples dropped, noisy ones moved: what the rest of the method then takes for the surface's own."""

import numpy as np

from ..points import Samples, local_spacing
from ..progress import Progress
from ..settings import Settings
from .outliers import find_outliers
from .positions import denoise


def clean(samples: Samples, settings: Settings = Settings(), progress=None) -> tuple[Samples, dict]:
    """Samples without strays and noise, and what was done about either, in input units, for the report.

    Clean samples come back as they are, bit for bit.
    """
    progress = Progress.of(progress)
    dropped = np.zeros(len(samples.points), bool)
    if settings.outliers:
        dropped = find_outliers(samples.points, progress.part(0.0, 0.3))
    if dropped.any():
        samples = samples.without(dropped, f"{dropped.sum()} of {len(dropped)} points dropped as outliers")
    spacing = local_spacing(samples.points, progress.part(0.3, 0.35))
    moved, done = denoise(samples.points, spacing, settings.denoise, settings.seed, progress.part(0.35, 1.0))
    if done:
        samples = samples.moved(moved)
        done |= {name: done[name] * samples.scale for name in ("noise", "mean_move")}
    return samples, {"outliers": int(dropped.sum()), **done}
