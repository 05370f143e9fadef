"""The whole method, in the order of the paper's algorithm box."""

import time
from dataclasses import asdict

import numpy as np

from .budget import check_budget, estimate_cost
from .cleaning.clean import clean
from .field.distance_field import DistanceField
from .field.grid import fit_grid
from .field.integration import NearBand, distance_field
from .field.local_surface import fit_local_surface
from .memory import peak_memory_mb
from .normals.estimate import checked_constraints, estimate_normals
from .points import local_spacing, prepare_samples
from .progress import Progress
from .reconstruction import Reconstruction
from .settings import Settings
from .surface.extract import extract_surfaces


def reconstruct(points, settings: Settings = Settings(), constraints=None, progress=None) -> Reconstruction:
    """Unsigned distance field, normals and surface of a point cloud without normals.

    points      : (n,3) array-like of any scale and place; rows that are not finite and exact duplicates are dropped
    constraints : (indices (k,), axes (k,3)), normals to hold fixed at rows of `points`, or None
    progress    : callback (fraction, stage) -> bool or None; False cancels

    Example
    -------
    >>> import numpy as np
    >>> from core import reconstruct, Settings
    >>> sphere = np.random.default_rng(0).normal(size=(500, 3))
    >>> sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    >>> result = reconstruct(sphere, Settings(resolution=32, surface="none"))
    >>> abs(result.field.sample([[0, 0, 1.5]])[0] - 0.5) < 0.01
    True

    Raises :class:`InputError` for points or constraints that cannot be used and for the signed surface of a shape that
    is not closed, :class:`MissingDependency` where no library that extracts iso-surfaces is found, :class:`Cancelled`
    where `progress` says so.
    """
    progress, stages = Progress.of(progress), _Stages()

    with stages("points"):
        samples = prepare_samples(points)

    with stages("cleaning"):
        samples, cleaning = clean(samples, settings, progress.part(0.0, 0.1, "cleaning"))
        constraints = checked_constraints(constraints, samples.source_index)
        spacing = local_spacing(samples.points)
        grid = fit_grid(samples.points, settings.resolution)
        estimate = estimate_cost(spacing, grid)
        check_budget(estimate, len(spacing), grid, settings)

    with stages("normals"):
        normals, confidence, counts = estimate_normals(
            samples.points, spacing, settings, constraints, progress.part(0.1, 0.2, "normals")
        )

    with stages("field"):
        local = fit_local_surface(samples.points, normals, confidence, spacing, settings.bridge)
        values, band = distance_field(local, grid, settings.integration, progress.part(0.2, 0.8, "distance field"))

    with stages("surface"):
        part = progress.part(0.8, 1.0)
        surfaces = extract_surfaces(values, band, local, grid, settings, samples.to_input_units, part)

    report = {
        "settings": asdict(settings),
        "counts": {
            "input": len(np.asarray(points)),
            "samples": len(samples.points),
            **counts,
            "rim_samples": int((local.rims.gap & ~local.rims.bridged).sum()),
            "bridged_samples": int(local.rims.bridged.sum()),
            "nodes": int(np.prod(grid.shape)),
        },
        "cleaning": cleaning,
        "meshes": {
            kind: {"vertices": len(mesh.vertices), "faces": len(mesh.faces), "borders": mesh.border_loops()}
            for kind, mesh in surfaces.meshes.items()
        },
        "grid": {"shape": list(grid.shape), "cell": grid.spacing * samples.scale},
        "spacing": float(np.median(spacing)) * samples.scale,
        "seconds": stages.seconds,
        "estimate": asdict(estimate),
        "peak_memory_mb": peak_memory_mb(),
        "warnings": [*samples.warnings, *surfaces.warnings],
    }
    progress(1.0)
    return Reconstruction(
        points=samples.given,
        source_index=samples.source_index,
        normals=normals,
        confidence=confidence,
        field=DistanceField(
            surfaces.values * np.float32(samples.scale),
            samples.to_input_units(grid.origin),
            grid.spacing * samples.scale,
            sdf="signed" in surfaces.meshes,
        ),
        surface=surfaces.meshes.get("double", surfaces.meshes.get("signed")),
        sheet=surfaces.meshes.get("single"),
        near=NearBand(band.node, band.step * samples.scale),
        report=report,
    )


class _Stages:
    """Seconds spent in each stage, by name."""

    def __init__(self):
        self.seconds = {}

    def __call__(self, name):
        self._name, self._start = name, time.perf_counter()
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.seconds[self._name] = time.perf_counter() - self._start
