"""Stage one: bi-directional normals."""

import numpy as np

from ..errors import InputError
from ..progress import Progress
from ..settings import Settings
from ..voronoi.facets import voronoi_facets
from .pca import pca_normals
from .reflection import reflection_sweeps


def estimate_normals(points, spacing, settings: Settings = Settings(), constraints=None, progress=None):
    """Unit axes, confidence and what the solver did, for distinct samples.

    points      : (n,3) float64     spacing : (n,) float64, local spacing, same units
    constraints : (indices (k,), axes (k,3)) held fixed, or None
    Returns normals (n,3), confidence (n,) in [0,1] and a dict for the report.
    """
    progress = Progress.of(progress)
    if settings.solver == "pca":
        normals, confidence = pca_normals(points)
        if constraints is not None:
            normals[constraints[0]] = constraints[1]
        return normals, confidence, {}
    facets = voronoi_facets(points, spacing, settings.seed)
    progress(0.7)
    normals, confidence, sweeps = reflection_sweeps(points, facets, constraints, progress=progress.part(0.7, 1.0))
    return normals, confidence, {"facets": len(facets.pairs), "sweeps": sweeps}


def checked_constraints(constraints, source_index: np.ndarray):
    """Constraints given by rows of the input, as (rows of the samples used, unit axes); None stays None.

    Rows that were dropped (duplicates, NaN) are ignored. Raises :class:`InputError` for shapes that do not match,
    rows outside the input, or axes without a direction.
    """
    if constraints is None:
        return None
    try:
        indices, axes = constraints
        indices, axes = np.asarray(indices), np.asarray(axes, np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"constraints are not (indices, axes): {error}") from error
    if indices.ndim != 1 or axes.shape != (len(indices), 3) or (len(indices) and indices.dtype.kind not in "iu"):
        raise InputError(
            f"constraints have shapes {indices.shape} and {axes.shape}; give whole-number indices (k,) and axes (k,3)"
        )
    length = np.linalg.norm(axes, axis=1)
    if not (np.isfinite(length) & (length > 0)).all():
        raise InputError(f"{int((~(length > 0)).sum())} constraint axes have no direction; give finite non-zero axes")
    position = {row: i for i, row in enumerate(source_index.tolist())}
    used = np.array([row in position for row in indices.tolist()], bool)
    rows = np.array([position[row] for row in indices[used].tolist()], np.int64)
    return rows, axes[used] / length[used, None]
