"""Normals that are given: found by an earlier run, or by hand."""

import numpy as np

from ..errors import InputError
from ..given_arrays import real_numbers


def known_normals(known, count: int, source_index) -> tuple[np.ndarray, np.ndarray]:
    """Unit axes (n,3) and confidence (n,) of the samples at rows `source_index` (n,) of `count` points, from those of
    all points: `known` = (axes (count,3), confidence (count,)).

    Raises :class:`InputError` where these are no such arrays, an axis has no direction or a confidence is not finite.
    """
    try:
        axes, confidence = known
    except (TypeError, ValueError) as error:
        raise InputError(f"known normals are no pair of arrays ({error}); give (axes, confidence)") from error
    axes = real_numbers(axes, "known normals", f"a ({count},3) array")
    confidence = real_numbers(confidence, "confidences", f"a ({count},) array")
    if axes.shape != (count, 3) or confidence.shape != (count,):
        raise InputError(
            f"known normals have shapes {axes.shape} and {confidence.shape} for {count} points; give axes ({count},3) "
            f"and confidence ({count},)"
        )
    axes, confidence = axes[source_index], confidence[source_index]
    if not np.isfinite(confidence).all():
        raise InputError(f"{(~np.isfinite(confidence)).sum()} confidences are not finite; give numbers from 0 to 1")
    return unit_axes(axes, "known normals"), np.clip(confidence, 0.0, 1.0)


def unit_axes(axes: np.ndarray, what: str) -> np.ndarray:
    """Axes (k,3) of any length, made unit; `what` they are goes into the :class:`InputError` where some have no
    direction."""
    largest = np.abs(axes).max(axis=1)
    aimless = ~(np.isfinite(largest) & (largest > 0))
    if aimless.any():
        raise InputError(f"{aimless.sum()} {what} have no direction; give finite non-zero axes")
    axes = np.ldexp(axes, -np.frexp(largest)[1][:, None])  # exact, and no square over- or underflows
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)
