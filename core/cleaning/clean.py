"""Stray samples dropped, dense lines thinned, noisy samples moved: what the method then takes for the surface's own."""

import numpy as np

from ..field.grid import fit_grid
from ..points import Samples
from ..progress import Progress
from ..settings import Settings
from .dense_lines import thinned_lines
from .depth_steps import between_steps
from .filled import bounds_volume, fills_volume
from .outliers import find_outliers
from .positions import denoise
from .voxels import find_voxels

_SOLID = 0.15  # of the samples of voxels are inside, at least, of a solid; where surfaces alone meet, up to .03
_FAR = 2.0  # sides of the box around all over that around those kept, from which on larger cells are spoken of


def clean(samples: Samples, settings: Settings = Settings(), progress=None) -> tuple[Samples, dict]:
    """Samples without strays, noise, steps of depth and insides of solids, with dense lines thinned; and what was done
    about strays, lines, noise and steps, in input units, for the report.

    Clean samples come back as they are, bit for bit.
    """
    progress = Progress.of(progress)
    samples, stepped = _off_steps_of_depth(samples, settings.denoise, progress.part(0.0, 0.1))
    if settings.outliers:
        samples = _boundary_of_solid(samples, settings.seed)
        dropped = find_outliers(samples.points, progress.part(0.1, 0.3))
    else:
        dropped = np.zeros(len(samples.points), bool)
    if dropped.any():
        samples = samples.without(dropped, _said_of_dropped(dropped, samples.points))
    count = len(samples.points)
    if settings.outliers:
        samples = _with_lines_thinned(samples, settings.resolution, progress.part(0.3, 0.4))
    thinned = count - len(samples.points)
    samples, done = _off_noise(samples, settings, progress.part(0.4, 1.0))
    return samples, {"outliers": int(dropped.sum()), "thinned": thinned, **stepped, **done}


def _with_lines_thinned(samples, resolution, progress):
    """The samples, and of those on dense lines fewer."""
    left = thinned_lines(samples.points, fit_grid(samples.points, resolution).spacing, progress)
    if left.all():
        return samples
    said = (
        f"{(~left).sum()} of {len(left)} points dropped from lines, where they lie much closer than the next line and "
        "than a cell; with outliers off they stay"
    )
    return samples.without(~left, said)


def _said_of_dropped(dropped, points):
    """How many were dropped; and if the box around them and the rest is much larger, that its cells are, too."""
    said = f"{dropped.sum()} of {len(dropped)} points dropped as outliers"
    every, rest = (np.ptp(some, axis=0).max() for some in (points, points[~dropped]))
    if every < _FAR * rest:
        return said
    larger = f"the grid's cells would be {every / rest:.2g} times as large with them"
    return f"{said}, some so far from the rest that {larger}; with outliers off they stay"


def _boundary_of_solid(samples, seed):
    """The samples; of a solid of voxels, which is full of them, those that bound it."""
    voxels = find_voxels(samples.points, seed) if len(samples.points) > 1 else None
    if voxels is None or (inside := voxels.inside()).mean() < _SOLID:
        return samples
    return samples.without(inside, _said_of_inside(inside, "a solid of voxels"))


def _said_of_inside(inside, solid):
    return (
        f"{inside.sum()} of {len(inside)} points lie inside {solid}: its boundary alone is taken; with outliers off "
        "they stay"
    )


def _off_noise(samples, settings, progress):
    """The samples moved off noise, where it is, and what was done; of those that fill a volume evenly, those that bound
    it, moved likewise."""
    points, strength, seed = samples.points, settings.denoise, settings.seed
    spacing = samples.local_spacing(progress.part(0.0, 0.1))
    moved, done = denoise(points, spacing, strength, seed, progress.part(0.1, 0.9))
    if not done:
        return samples, {}
    filled, even = (False, False) if "voxel" in done else fills_volume(points, done["neighbours"][1], seed)
    if filled and even and settings.outliers:
        inside = ~bounds_volume(points, spacing, seed, progress.part(0.9, 0.92))
        if inside.any():
            samples = samples.without(inside, _said_of_inside(inside, "a volume that they fill"))
            return _off_noise(samples, settings, progress.part(0.92, 1.0))
    done |= {name: done[name] * samples.scale for name in ("noise", "mean_move", "voxel") if name in done}
    return samples.moved(moved, *_said_of_moved(done, filled, strength)), done


def _said_of_moved(done, filled, strength):
    """What to warn of: a surface that is a guess, moves that nobody asked for."""
    if "voxel" in done:
        yield (
            f"points are in steps of {done['voxel']:.2g}, as voxels and whole heights are: they were moved off these; "
            "with denoise=0 they stay"
        )
    elif filled:
        yield (
            "points fill a volume: the surface through them is a guess; give those of its boundary alone, or make a "
            "volume of the points"
        )
    elif strength == "auto":
        yield (
            f"{done['noisy']} points look noisy: they were moved by {done['mean_move']:.2g} on average; with denoise=0 "
            "they stay"
        )


def _off_steps_of_depth(samples, strength, progress):
    """The samples moved off the steps of depth that they are in, where they are, and the largest of these."""
    if strength == 0:
        return samples, {}
    moved, frame = between_steps(samples.given, progress)
    if frame is None:
        return samples, {}
    largest = frame.step * np.abs(samples.given[:, frame.axis]).max() ** 2
    step = (1.0 if strength == "auto" else strength) * (moved - samples.given)
    said = (
        f"depth is in steps of up to {largest:.2g}, as a depth camera sees it: points were moved off them; with "
        "denoise=0 they stay"
    )
    return samples.moved(samples.points + step / samples.scale, said), {"depth_step": float(largest)}
