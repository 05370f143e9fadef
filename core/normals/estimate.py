"""Stage one: bi-directional normals."""

import numpy as np

from ..errors import InputError, SettingsError
from ..given_arrays import real_numbers, spacing_of, workable_points
from ..linalg import row_dots
from ..points import MINIMUM_SAMPLES, refuse_copies
from ..progress import Progress
from ..settings import Settings
from ..voronoi.bisectors import bisector_samples
from ..voronoi.facets import voronoi_facets
from ..voronoi.lines import across_lines
from ..voronoi.polygons import facet_polygons
from .adam import minimise
from .creases import normals_of_sheets
from .energy import NormalEnergy
from .energy_torch import torch_device, torch_value_and_gradient, uses_torch
from .known import unit_axes
from .mirrors import Mirrors
from .pca import pca_normals
from .reflection import reflection_sweeps
from .walls import normals_of_walls

_SAME_AXIS = 1 - 1e-9  # least |a . b| of unit axes that one row may be given


def estimate_normals(points, spacing, settings: Settings = Settings(), constraints=None, progress=None):
    """Unit axes, confidence and what the solver did, for distinct samples.

    points      : (n,3) float64     spacing : (n,) float64, local spacing, same units
    constraints : (indices (k,), axes (k,3) of any length) held fixed, or None
    Returns normals (n,3), confidence (n,) in [0,1] and a dict for the report.

    The energy starts from the same Voronoi-weighted plane fit as the sweeps. The paper starts it from random axes,
    from which Adam ends in poorer minima: three shapes reached a mean |n.n_true| of .934, .962 and .975 instead of
    .970, .989 and .9999.

    Raises :class:`InputError` for fewer than 4 points, points that are not finite, that powers of distances between
    cannot be worked with, or that occur twice (but the plain plane fit takes such), spacings that are none, and
    constraints as :func:`checked_constraints` does,
    :class:`MissingDependency` where torch or a GPU is asked for and missing, :class:`SettingsError` where NumPy is to
    use a GPU.
    """
    progress, points = Progress.of(progress), workable_points(points, least=MINIMUM_SAMPLES)
    spacing = spacing_of(points, spacing)
    constraints, _ = checked_constraints(constraints, np.arange(len(points)), len(points))
    if settings.solver == "pca":
        normals, confidence = pca_normals(points)
        if constraints is not None:
            normals[constraints[0]] = constraints[1]
        return normals, confidence, {}
    refuse_copies(points)
    if settings.solver == "energy":
        return _least_energy(points, spacing, settings, constraints, progress)
    heeded, stretch = across_lines(points, spacing, progress.part(0.0, 0.02))
    facets = voronoi_facets(points, heeded, settings.seed, progress.part(0.02, 0.7))
    mirrors = Mirrors(points, heeded, facets, stretch, progress.part(0.7, 0.75))
    normals, confidence, report = swept_normals(points, spacing, mirrors, constraints, None, progress.part(0.75, 1.0))
    return normals, confidence, {"facets": len(facets.pairs), **report}


def swept_normals(points, spacing, mirrors: Mirrors, constraints=None, start=None, progress=None):
    """The axes (n,3) and confidence (n,) that sweeps over the `mirrors` of the samples (n,3) end with, told apart where
    sheets run close or meet at an angle, and a dict for the report; constraints as above, `start` (n,3) unit axes to
    begin with or None for a plane fit."""
    progress = Progress.of(progress)
    normals, sweeps = reflection_sweeps(mirrors, constraints, start, progress.part(0.0, 0.4))
    fixed = () if constraints is None else constraints[0]
    normals, mirrors = normals_of_walls(points, spacing, mirrors, normals, fixed, progress.part(0.4, 0.6))
    normals, confidence, beside = normals_of_sheets(points, spacing, mirrors, normals, fixed, progress.part(0.6, 1.0))
    return normals, confidence, {"sweeps": sweeps, "beside_creases": int(beside.sum())}


def _least_energy(points, spacing, settings, constraints, progress):
    backend, device = _backend(settings)
    spacing, _ = across_lines(points, spacing)
    polygons = facet_polygons(points, spacing, settings.seed, progress.part(0.0, 0.1))
    samples = bisector_samples(polygons, spacing, seed=settings.seed)
    progress(0.2)
    energy, mirrors = NormalEnergy(points, spacing, samples), Mirrors(points, spacing, samples.facets)
    evaluate = torch_value_and_gradient(energy, device) if backend == "torch" else energy.value_and_gradient
    normals, history = minimise(evaluate, mirrors.plane_fit(), constraints, progress.part(0.2, 1.0))
    report = {
        "facets": len(samples.facets.pairs),
        "bisector_samples": len(samples.facet),
        "backend": backend,
        "device": device,
        "energy": history,
    }
    return normals, mirrors.confidence(normals), report


def _backend(settings):
    """What differentiates the energy, and where: "numpy" or "torch", and "cpu" or "cuda"."""
    if uses_torch(settings):
        return "torch", torch_device(settings.device)
    if settings.device == "cuda":
        raise SettingsError(
            "device is 'cuda' and backend 'numpy', which uses no GPU; use backend 'torch', or device 'cpu'"
        )
    return "numpy", "cpu"


def checked_constraints(constraints, source_index: np.ndarray, count: int):
    """Constraints given by rows of an input of `count` rows, as (rows of the samples used, unit axes), and warnings;
    None, or none of them, gives None.

    Rows that were dropped (duplicates, strays, NaN) are ignored, which is what the warning says, and so are indices
    that are masked. Raises :class:`InputError` for shapes that do not match, rows outside the input, rows with more
    than one axis, or axes without a direction.
    """
    if constraints is None:
        return None, ()
    try:
        indices, axes = constraints
        indices = np.asanyarray(indices)
    except (TypeError, ValueError) as error:
        raise InputError(f"constraints are not (indices, axes): {error}") from error
    axes = real_numbers(axes, "constraint axes", "a (k,3) array")
    if not indices.size and not axes.size:
        return None, ()
    if indices.size and indices.dtype.kind not in "iu":
        raise InputError(
            f"constraint indices are {indices.dtype}; give whole numbers, of a mask what numpy.flatnonzero(mask) does"
        )
    if indices.ndim != 1 or axes.shape != (len(indices), 3):
        raise InputError(
            f"constraints have shapes {indices.shape} and {axes.shape}; give whole-number indices (k,) and axes (k,3)"
        )
    given = ~np.ma.getmaskarray(indices)
    indices, axes = np.asarray(indices)[given], axes[given]
    outside = (indices < 0) | (indices >= count)
    if outside.any():
        raise InputError(
            f"{outside.sum()} constraints are for rows outside the input, row {indices[outside][0]} the first; "
            f"give rows from 0 to {count - 1}"
        )
    axes = unit_axes(axes, "constraint axes")
    _refuse_two_axes(indices, axes)
    position = np.full(count, -1)
    position[source_index] = np.arange(len(source_index))
    rows = position[indices.astype(np.int64)]
    used = rows >= 0
    warnings = ()
    if not used.all():
        warnings = (f"{(~used).sum()} of {len(used)} constraints ignored: their points were dropped",)
    return (rows[used], axes[used]), warnings


def _refuse_two_axes(indices, axes):
    order = np.argsort(indices, kind="stable")
    agreement = np.abs(row_dots(axes[order[1:]], axes[order[:-1]]))
    differ = np.flatnonzero((np.diff(indices[order]) == 0) & (agreement < _SAME_AXIS))
    if len(differ):
        raise InputError(f"row {indices[order[differ[0]]]} is constrained to axes that differ; give each row one")
