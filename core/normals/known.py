"""Normals found by an earlier run, taken as they are."""

import numpy as np

from ..errors import InputError


def known_normals(known, count: int, source_index) -> tuple[np.ndarray, np.ndarray]:
    """Unit axes (n,3) and confidence (n,) of the samples at rows `source_index` (n,) of `count` points, from those of
    all points: `known` = (axes (count,3), confidence (count,)).

    Raises :class:`InputError` where the shapes do not match or an axis has no direction.
    """
    axes, confidence = (np.asarray(values, np.float64) for values in known)
    if axes.shape != (count, 3) or confidence.shape != (count,):
        raise InputError(
            f"known normals have shapes {axes.shape} and {confidence.shape} for {count} points; give axes ({count},3) "
            f"and confidence ({count},)"
        )
    axes, confidence = axes[source_index], confidence[source_index]
    length = np.linalg.norm(axes, axis=1)
    useless = ~(np.isfinite(length) & (length > 0))
    if useless.any():
        raise InputError(f"{int(useless.sum())} known normals have no direction; give finite non-zero axes")
    return axes / length[:, None], np.clip(confidence, 0.0, 1.0)
