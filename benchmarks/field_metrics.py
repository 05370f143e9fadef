"""How far a distance field is from the true distance, where it matters and how."""

import numpy as np
from scipy.spatial import KDTree

from core import DistanceField, Mesh

from .geometry import border_points, closest_points, surface_points

SAMPLES = 20_000
NEAR = 0.05
RIM_STEPS = (4, 8, 16)

_REACH = 1.5  # cells: a gradient read at x depends on nodes up to this far from it
_SMOOTH = 0.02  # slope of the exact distance may differ from 1 by this where the field is asked to have slope 1
_RIM_TILT = np.radians(60)
_FEWEST = 50  # points below which a rim statistic means nothing


def field_errors(field: DistanceField, truth: Mesh, samples: np.ndarray, seed: int = 0) -> dict:
    """Every measure of this module that is not about rims, on SAMPLES seeded points each.

    box, near  : mean |u - d| x1e3 over points uniform in the box, and over points within NEAR of the true surface
    eikonal    : see :func:`eikonal_error`, over the box     angle : see :func:`angle_error`, near the surface
    on_surface : mean u on the true surface, cells. Exact nodes read trilinearly would make it 0.33
    above_share, above_max : see :func:`above_nearest_sample`
    """
    rng = np.random.default_rng(seed)
    in_box, close = box_points(field, SAMPLES, rng), near_points(truth, SAMPLES, rng)
    return {
        "box": 1e3 * distance_error(field, truth, in_box),
        "near": 1e3 * distance_error(field, truth, close),
        "eikonal": eikonal_error(field, truth, in_box),
        "angle": angle_error(field, truth, close),
        "on_surface": field.sample(surface_points(truth, SAMPLES, rng)).mean() / field.spacing,
        **above_nearest_sample(field, samples, np.concatenate([in_box, close])),
    }


def box_points(field: DistanceField, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points (count,3) uniform in the field's box, two cells off its walls."""
    cells = np.array(field.values.shape) - 1
    return field.origin + field.spacing * rng.uniform(2, cells - 2, (count, 3))


def near_points(truth: Mesh, count: int, rng: np.random.Generator) -> np.ndarray:
    """Area-uniform surface points, each moved by a vector uniform in the ball of radius NEAR, (count,3)."""
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return surface_points(truth, count, rng) + NEAR * np.cbrt(rng.random((count, 1))) * direction


def distance_error(field: DistanceField, truth: Mesh, x: np.ndarray) -> float:
    """Mean |u - d| over those of the points (m,3) that the field's band reaches."""
    x, distance, _ = _reached(field, truth, x)
    return np.abs(field.sample(x) - distance).mean()


def eikonal_error(field: DistanceField, truth: Mesh, x: np.ndarray) -> float | None:
    """Mean | |grad u| - 1 | away from the surface and the medial axis; None where no point is.

    A point counts where the exact distance itself, differenced over the nodes that the field's gradient depends on
    (1.5 cells either way), has a slope within 0.02 of 1: no method can be asked for slope 1 where the truth has a kink
    inside the stencil.
    """
    x, _, _ = _reached(field, truth, x)
    step = _REACH * field.spacing
    sides = [[closest_points(x + sign * e, truth)[0] for sign in (1, -1)] for e in step * np.eye(3)]
    slope = np.linalg.norm([(ahead - behind) / (2 * step) for ahead, behind in sides], axis=0)
    smooth = x[np.abs(slope - 1) < _SMOOTH]
    return np.abs(np.linalg.norm(field.gradient(smooth), axis=1) - 1).mean() if len(smooth) else None


def angle_error(field: DistanceField, truth: Mesh, x: np.ndarray) -> float | None:
    """Median angle, degrees, between grad u and the direction from the closest point of the true surface, over points
    further from it than the gradient's stencil reaches (1.5 cells); None where no point is."""
    x, distance, foot = _reached(field, truth, x)
    clear = distance > _REACH * field.spacing
    if not clear.any():
        return None
    gradient, away = field.gradient(x[clear]), (x - foot)[clear]
    sine = np.linalg.norm(np.cross(gradient, away), axis=1)
    return np.degrees(np.median(np.arctan2(sine, np.einsum("mi,mi->m", gradient, away))))


def above_nearest_sample(field: DistanceField, samples: np.ndarray, x: np.ndarray) -> dict:
    """Where u exceeds the distance to the nearest sample, which no distance to a surface through the samples can.

    Looked at on the nodes nearest to the points (m,3), so that interpolation plays no part. above_share: share of
    nodes more than a thousandth of a cell above; above_max: largest excess in cells.
    """
    nodes = np.rint((x - field.origin) / field.spacing).astype(int)
    nodes = np.unique(nodes[((nodes >= 0) & (nodes < field.values.shape)).all(axis=1)], axis=0)
    nearest, _ = KDTree(samples).query(field.origin + field.spacing * nodes, workers=-1)
    above = (field.values[tuple(nodes.T)] - nearest) / field.spacing
    return {"above_share": (above > 1e-3).mean(), "above_max": max(above.max(), 0.0)}


def past_rims(field: DistanceField, truth: Mesh, seed: int = 0) -> dict:
    """u / d past open rims, for each of RIM_STEPS cells out: see :func:`ratios`; {} where the truth has no border."""
    probes = rim_probes(field, truth, seed)
    return {str(cells): ratios(field.sample(x), distance) for cells, (x, distance) in probes.items()}


def rim_probes(field: DistanceField, truth: Mesh, seed: int = 0) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Points past the rim and their true distances, for each of RIM_STEPS cells out; {} where the truth has no border.

    Points leave the border edges at up to 60 degrees from the sheet's own direction and count where the border is the
    nearest part of the truth (exact distance within 0.1 % of the step) and the box contains them.
    """
    rng = np.random.default_rng(seed)
    border, outward, up = border_points(truth, SAMPLES, rng)
    if not len(border):
        return {}
    tilt = rng.uniform(-_RIM_TILT, _RIM_TILT, (len(border), 1))
    direction = np.cos(tilt) * outward + np.sin(tilt) * up
    low, high = field.origin, field.origin + field.spacing * (np.array(field.values.shape) - 1)
    probes = {}
    for cells in RIM_STEPS:
        step = cells * field.spacing
        x, distance, _ = _reached(field, truth, border + step * direction)
        counted = (np.abs(distance - step) < 1e-3 * step) & ((x >= low) & (x <= high)).all(axis=1)
        probes[cells] = x[counted], distance[counted]
    return probes


def ratios(u: np.ndarray, distance: np.ndarray) -> dict:
    """Of u / d: mean, off (mean |u / d - 1|), p05 and p95 (percentiles) and the number of points, all (m,) given."""
    if len(u) < _FEWEST:
        return {"mean": None, "off": None, "p05": None, "p95": None, "points": len(u)}
    ratio = u / distance
    p05, p95 = np.percentile(ratio, [5, 95])
    return {"mean": ratio.mean(), "off": np.abs(ratio - 1).mean(), "p05": p05, "p95": p95, "points": len(ratio)}


def _reached(field, truth, x):
    """The points that lie in the field's band with their stencils, their true distances and closest points."""
    distance, foot = closest_points(x, truth)
    reached = distance + _REACH * field.spacing < field.band
    return x[reached], distance[reached], foot[reached]
