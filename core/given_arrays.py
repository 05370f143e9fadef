"""Arrays as a caller gives them, checked."""

import numpy as np

from .errors import InputError

_SMALLEST, _LARGEST = 1e-60, 1e60  # span of points, of which higher powers in double precision are told from 0 and inf


def real_numbers(given, what: str, wanted: str) -> np.ndarray:
    """An array-like as float64, NaN where it is masked. Raises :class:`InputError`, with `what` it is and what is
    `wanted` instead, where it is none, or complex."""
    try:
        given = np.asanyarray(given)
        if np.iscomplexobj(given):
            raise TypeError("complex numbers")
        return np.asarray(np.ma.filled(given.astype(np.float64), np.nan))
    except (TypeError, ValueError, OverflowError, RuntimeError) as error:  # the last of tensors that need gradients
        raise InputError(f"{what} are not an array of real numbers ({error}); give {wanted}") from error


def points_array(given) -> np.ndarray:
    """An array-like of points as (n,3) float64. Raises :class:`InputError` for another shape or other than numbers."""
    points = real_numbers(given, "points", "an (n,3) array")
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"points have shape {points.shape}; give an (n,3) array of x, y, z")
    return points


def finite_points(given, least: int = 0) -> np.ndarray:
    """The same of points that are all finite, at `least` so many; raises :class:`InputError` otherwise."""
    points = points_array(given)
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        raise InputError(f"{(~finite).sum()} of {len(points)} points are not finite; leave them out")
    if len(points) < least:
        raise InputError(f"{len(points)} points given; at least {least} are needed")
    return points


def workable_points(given, least: int = 0) -> np.ndarray:
    """The same of points that are all in one place, or span so much that powers of distances can be worked with; raises
    :class:`InputError` otherwise."""
    points = finite_points(given, least)
    if len(points) and np.ptp(points / 2, axis=0).any():
        span_of(points, "powers of distances", _SMALLEST, _LARGEST)
    return points


def span_of(points: np.ndarray, powers: str, least: float, most: float) -> float:
    """Longest side of the box around points (n,3), their units. Raises :class:`InputError` where it is not between
    `least` and `most`, as `powers` of distances that are worked with, named in the message, need."""
    with np.errstate(over="ignore"):
        span = float(np.ptp(points, axis=0).max())
    if not least <= span <= most:
        raise InputError(
            f"the points span {span:g}; {powers} need a span from {least:g} to {most:g}, so scale them to an ordinary "
            "size"
        )
    return span


def attribute_rows(name: str, given, count: int) -> np.ndarray:
    """An array-like of `count` rows of any type, masked where it is, for the attribute of that name. Raises
    :class:`InputError` for what is no array, and for another number of rows."""
    try:
        values = np.asanyarray(given)
    except ValueError as error:
        raise InputError(f"attribute {name!r} is no array ({error}); give {count} rows") from error
    if values.shape[:1] != (count,):
        raise InputError(f"attribute {name!r} has shape {values.shape}; give {count} rows")
    return values


def spacing_of(points: np.ndarray, given) -> np.ndarray:
    """Local spacing (n,) float64 of points (n,3). Raises :class:`InputError` for another shape, and for what is not
    above 0 and finite."""
    spacing = real_numbers(given, "local spacings", "an (n,) array, as local_spacing(points) gives it")
    if spacing.shape != (len(points),):
        raise InputError(f"local spacings have shape {spacing.shape}; give one for each of the {len(points)} points")
    if not ((spacing > 0) & (spacing < np.inf)).all():
        raise InputError(
            "some local spacings are not above 0 and finite; give what local_spacing(points) does, no point twice"
        )
    return spacing
