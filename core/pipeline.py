"""The whole method, in the order of the paper's algorithm box."""

import time
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import partial

import numpy as np

from .budget import check_budget, crowded_share, estimate_cost
from .cleaning.clean import clean
from .errors import SettingsError
from .field.distance_field import BandedField, DistanceField
from .field.grid import fit_grid
from .field.integration import distance_field
from .field.local_surface import fit_local_surface
from .field.narrow_band import banded_field, trimmed
from .memory import peak_memory_mb
from .normals.estimate import checked_constraints, estimate_normals
from .normals.known import known_normals
from .parallel import workers
from .points import prepare_samples, rounding_warning
from .progress import watched
from .reconstruction import Reconstruction
from .settings import WHOLE_BOX, Settings
from .surface.extract import band_for, extract_surfaces
from .surface.facts import mesh_facts

_COARSE = 0.1  # cells, median local spacing below which a warning says that the grid is too coarse for the points


def reconstruct(
    points, settings: Settings = Settings(), constraints=None, progress=None, normals=None
) -> Reconstruction:
    """Unsigned distance field, normals and surface of a point cloud without normals.

    points      : (n,3) array-like of any scale and place; rows that are not finite, duplicates and near copies of
                  others are dropped
    constraints : (indices (k,), axes (k,3)), normals to hold fixed at rows of `points`, or None
    progress    : callback (fraction, stage) -> bool or None; False cancels
    normals     : (axes (n,3), confidence (n,)) of all points, as an earlier run found them, or None; with them the
                  cleaning and the search for normals are left out, and constraints are checked alone

    Example
    -------
    >>> import numpy as np
    >>> from core import reconstruct, Settings
    >>> sphere = np.random.default_rng(0).normal(size=(500, 3))
    >>> sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    >>> result = reconstruct(sphere, Settings(resolution=32, surface="none"))
    >>> bool(abs(result.field.sample([[0, 0, 1.5]])[0] - 0.5) < 0.01)
    True

    Raises :class:`InputError` for points or constraints that cannot be used and for the signed surface of a shape that
    is not closed, :class:`MemoryBudgetError` where the run would need more memory than it may have, once the points are
    cleaned, :class:`SettingsError` where NumPy is asked for on a GPU and where the grid cannot hold the diffusion,
    :class:`MissingDependency` where no library that extracts iso-surfaces is found, or no torch or GPU that was asked
    for, :class:`Cancelled` where `progress` says so.
    """
    return watched(partial(_reconstruct, points, settings, constraints, normals), progress)


@workers()
def _reconstruct(points, settings, constraints, normals, progress):
    if not isinstance(settings, Settings):
        raise SettingsError(f"settings are {settings!r}; give Settings(...), or nothing for the defaults")
    seconds = {}
    with _timed(seconds, "points"):
        samples = prepare_samples(points, progress.part(0.0, 0.01, "points")).in_spatial_order()
        given = len(np.asarray(points))

    with _timed(seconds, "cleaning"):
        cleaning, unmoved = {}, samples.given
        if normals is None:
            samples, cleaning = clean(samples, settings, progress.part(0.01, 0.09, "cleaning"))
        constraints, ignored = checked_constraints(constraints, samples.source_index, given)
        spacing = samples.local_spacing(progress.part(0.09, 0.1, "cleaning"))
        typical = float(np.median(spacing)) * samples.scale
        rounded = rounding_warning(unmoved, typical)
        del unmoved
        grid = fit_grid(samples.points, settings.resolution)
        crowded = crowded_share(samples.points, spacing)
        estimate = estimate_cost(spacing, grid, settings, "noisy" in cleaning, crowded)
        large = check_budget(estimate, spacing, grid, settings)

    with _timed(seconds, "normals"):
        if normals is None:
            part = progress.part(0.1, 0.2, "normals")
            normals, confidence, solved = estimate_normals(samples.points, spacing, settings, constraints, part)
        else:
            normals, confidence = known_normals(normals, given, samples.source_index)
            solved = {}

    with _timed(seconds, "field"):
        part = progress.part(0.2, 0.25, "distance field")
        local = fit_local_surface(samples.points, normals, confidence, spacing, settings.bridge, part)
        part = progress.part(0.25, 0.8, "distance field")
        if settings.band is None:
            values, near = distance_field(local, grid, settings.integration, settings.diffusion, part)
            feet = None
        else:
            values, near, feet = banded_field(local, grid, band_for(settings, local, grid), part)

    with _timed(seconds, "surface"):
        part = progress.part(0.8, 0.99)
        surfaces = extract_surfaces(values, near, local, grid, settings, samples.to_input_units, part)

    report = {
        "settings": asdict(settings),
        "counts": {
            "input": given,
            "samples": len(samples.points),
            "rim_samples": int(local.rims.open.sum()),
            "bridged_samples": int(local.rims.bridged.sum()),
            "nodes": surfaces.values.size,
        },
        "cleaning": cleaning,
        "normals": solved,
        "meshes": mesh_facts(surfaces, progress.part(0.99, 1.0, "report")),
        "grid": {"shape": list(grid.shape), "cell": grid.spacing * samples.scale},
        "spacing": typical,
        "seconds": seconds,
        "estimate": asdict(estimate),
        "peak_memory_mb": peak_memory_mb(),
        "warnings": [*samples.warnings, *rounded, *ignored, *large, *_too_coarse(local, grid), *surfaces.warnings],
    }
    progress.part(0.0, 1.0, "report")(1.0)
    row = samples.given_order()
    near = replace(near, sample=np.argsort(row).astype(np.int32)[local.source[near.sample]])
    return Reconstruction(
        points=samples.given[row],
        source_index=samples.source_index[row],
        normals=normals[row],
        confidence=confidence[row],
        field=_field(surfaces, near, feet, grid, samples, settings.band),
        surface=surfaces.meshes.get("double", surfaces.meshes.get("signed")),
        sheet=surfaces.meshes.get("single"),
        report=report,
    )


def _too_coarse(local, grid):
    cells = local.spacing_in_cells(grid)
    if cells >= _COARSE:
        return ()
    return (
        f"points lie {cells:.2g} cells apart, and what they show within a cell is lost; raise the resolution, beyond "
        f"{WHOLE_BOX} with a band, or reconstruct parts that lie far from each other one by one",
    )


def _field(surfaces, near, feet, grid, samples, band):
    """The field in the input's units."""
    near = near.from_nearer()
    near = replace(near, step=near.step * samples.scale)
    origin, cell = samples.to_input_units(grid.origin), grid.spacing * samples.scale
    sdf, scale = "signed" in surfaces.meshes, np.float32(samples.scale)
    if band is None:
        return DistanceField(surfaces.values * scale, origin, cell, sdf=sdf, near=near)
    blocks = trimmed(surfaces.values, band * grid.spacing).map(lambda u: u * scale)
    return BandedField(blocks, origin, cell, band * cell, sdf, feet.in_cells(grid), near)


@contextmanager
def _timed(seconds, stage):
    """Puts the seconds that the stage takes into `seconds`, by its name."""
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start
