"""Validation of the input and the frame in which everything is computed."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from .errors import InputError
from .given_arrays import finite_points, points_array, span_of
from .near_duplicates import find_near_duplicates
from .progress import Progress
from .spatial_order import spatial_order
from .trees import nearest_others

MINIMUM_SAMPLES = 4
SPACING_NEIGHBOURS = 6
_SMALLEST, _LARGEST = 1e-30, 1e30  # span of the points, input units
_QUANTUM = 2.0**-53  # of coordinates in the unit frame: squares of distances are then zero only where those are
_ROUNDED, _ODD = 0.02, 0.25  # steps of coordinates, local spacings, that are told; share of odd numbers of these steps
_FLATNESS = 1e-9  # relative to the longest side; thinner than this counts as a line


@dataclass(frozen=True)
class Samples:
    """Distinct, finite samples and the similarity that takes them to the unit frame.

    points       : (n,3) float64, unit frame: bounding box centred at 0, longest side 1
    given        : (n,3) float64, the same in input units, exactly as given where they were not moved
    source_index : (n,) int64, row of each sample in the input
    centre       : (3,) float64, input units
    scale        : float, longest side of the bounding box in input units
    warnings     : what was dropped or moved, one line each
    """

    points: np.ndarray
    given: np.ndarray
    source_index: np.ndarray
    centre: np.ndarray
    scale: float
    warnings: tuple[str, ...] = ()

    def to_input_units(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(x, np.float64) * self.scale + self.centre

    def local_spacing(self, progress=None) -> np.ndarray:
        """:func:`local_spacing` of the points, found when it is first asked for."""
        if "_spacing" not in vars(self):
            vars(self)["_spacing"] = local_spacing(self.points, progress)
        return vars(self)["_spacing"]

    def in_spatial_order(self) -> "Samples":
        """The samples as :func:`spatial_order` has them, which is faster for whatever looks at neighbours."""
        return self._of_rows(spatial_order(self.points))

    def given_order(self) -> np.ndarray:
        """(n,) int64, rows of the samples as the input has them."""
        return np.argsort(self.source_index)

    def without(self, dropped: np.ndarray, warning: str) -> "Samples":
        """The samples not marked in `dropped`, (n,) bool, in a unit frame of their own."""
        kept = np.flatnonzero(~dropped)
        return _framed(self.given[kept], self.source_index[kept], (*self.warnings, warning))

    def moved(self, points: np.ndarray, *warnings: str) -> "Samples":
        """The samples at new places (n,3) of the unit frame, one of each that fell together; those that did not move
        stay exactly as given."""
        stirred = (points != self.points).any(axis=1)[:, None]
        points = np.rint(points / _QUANTUM) * _QUANTUM
        given = np.where(stirred, self.to_input_units(points), self.given)
        moved = replace(self, points=points, given=given, warnings=(*self.warnings, *warnings))
        return moved._of_rows(first_of_each(points, np.arange(len(points))))

    def _of_rows(self, rows):
        return replace(self, points=self.points[rows], given=self.given[rows], source_index=self.source_index[rows])


def prepare_samples(points, progress=None) -> Samples:
    """Check an (n,3) array-like, drop rows that are not finite, exact duplicates and near copies where there are many
    (see :mod:`.near_duplicates`), and scale to the unit frame.

    The centre is the middle of the bounding box, so clouds that differ by an exactly representable shift give the
    same samples bit for bit. Raises :class:`InputError` for a wrong shape or type, fewer than 4 distinct finite
    points, or points on one line (a plane is fine).
    """
    points, warnings = points_array(points), []
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    if len(finite) < len(points):
        warnings.append(f"{len(points) - len(finite)} of {len(points)} points dropped: NaN or infinite coordinates")
    source_index = first_of_each(points, finite)
    if len(source_index) < len(finite):
        warnings.append(f"{len(finite) - len(source_index)} exact duplicates dropped")
    if len(source_index) < MINIMUM_SAMPLES:
        raise InputError(
            f"{len(source_index)} distinct finite points of {len(points)} given; "
            f"at least {MINIMUM_SAMPLES} are needed for a surface"
        )

    samples = _framed(points[source_index], source_index, tuple(warnings))
    copies = find_near_duplicates(samples.points, progress)
    if not copies.any():
        return samples
    return samples.without(
        copies,
        f"{copies.sum()} of {len(copies)} points dropped: near copies of others, less than a fifth of the spacing away",
    )


def _framed(given, source_index, warnings):
    """Samples in the unit frame of their own bounding box."""
    scale = span_of(given, "distances in single precision", _SMALLEST, _LARGEST)
    low, high = given.min(axis=0), given.max(axis=0)
    centre = low + (high - low) / 2
    points = np.rint((given - low - (high - low) / 2) / (scale * _QUANTUM)) * _QUANTUM  # the centre is rounded
    distinct = first_of_each(points, np.arange(len(points)))
    if len(distinct) < len(points):
        warnings = (
            *warnings,
            f"{len(points) - len(distinct)} points dropped: on top of others, to float64 in this box",
        )
        points, given, source_index = points[distinct], given[distinct], source_index[distinct]
    if len(points) < MINIMUM_SAMPLES:
        raise InputError(
            f"{len(points)} points are distinct in a box of {scale:g}; "
            f"at least {MINIMUM_SAMPLES} are needed for a surface"
        )
    thickness = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if thickness[1] < _FLATNESS * thickness[0]:
        raise InputError(f"all {len(points)} distinct points lie on one line; a surface needs points off it")
    return Samples(points, given, source_index, centre, scale, warnings)


def local_spacing(points: np.ndarray, progress=None) -> np.ndarray:
    """rho, (n,) float64 in the units of `points`, (n,3) array-like: mean distance of each sample to its 6 nearest
    (fewer if n < 7). Raises :class:`InputError` for fewer than two points, or any that are not finite."""
    points = finite_points(points, least=2)
    return nearest_others(KDTree(points), SPACING_NEIGHBOURS, Progress.of(progress))[0].mean(axis=1)


def refuse_copies(points: np.ndarray) -> None:
    """Raises :class:`InputError` where points (n,3) occur twice."""
    n, (x, y, z) = len(points), points.T
    along = x + np.e * y + np.pi * z  # alike for copies, hardly ever for others
    if len(np.unique(along)) < n and (distinct := len(first_of_each(points, np.arange(n)))) < n:
        raise InputError(
            f"some points occur twice: {distinct} of {n} are distinct; give each of them once, as "
            "numpy.unique(points, axis=0) does"
        )


def rounding_warning(points: np.ndarray, spacing: float) -> tuple[str, ...]:
    """Says, in one line or none, that coordinates of points (n,3), float64, were rounded to the steps that single
    precision has so far from the origin, and that these are not small beside the `spacing` of the points. Whole numbers
    around ten million look so, too: the step there is 1."""
    size = np.median(np.abs(points), axis=0)
    axis = size.argmax()
    if np.abs(points[:, axis]).max() > np.finfo(np.float32).max:
        return ()
    step = float(np.spacing(np.float32(size[axis])))
    if step < _ROUNDED * spacing:
        return ()
    steps = points[:, axis] / np.spacing(np.abs(points[:, axis]).astype(np.float32)).astype(float)
    if (np.rint(steps) != steps).any() or (np.rint(0.5 * steps) != 0.5 * steps).mean() < _ODD:
        return ()
    return (
        f"coordinates around {size[axis]:g} are in steps of {step:.2g}, {step / spacing:.0%} of the points' spacing: "
        "single precision has no finer ones so far out; bring points closer to the origin before they are stored in it",
    )


def first_of_each(points, rows):
    """The rows (ascending) that hold the first occurrence of each distinct point; -0.0 equals 0.0."""
    x, y, z = (points[rows] + 0.0).T
    order = np.lexsort((rows, z, y, x))
    ordered = points[rows[order]]
    first = np.ones(len(order), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return np.sort(rows[order[first]])
