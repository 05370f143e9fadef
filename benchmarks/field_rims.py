"""What lies past open rims, how much of its error comes from the sampling, and ways to end a sheet."""

import numpy as np
from scipy.spatial import KDTree

from core import Mesh, reconstruct

from . import field_baselines as baselines
from .cases import Case
from .field_metrics import SAMPLES, near_points, ratios, rim_probes
from .field_quality import FIELD, POISSON
from .geometry import border_points, closest_points, surface_points

_HEMISPHERE, _RADIUS = 5_000, 0.4
_AROUND, _UP = 512, 128
_DRAWN = 4_000  # points that those laid on a rim are picked from
_APART = 0.7  # least distance of points laid on a rim, mean distances between samples


def hemisphere() -> Mesh:
    """A fine mesh of half a sphere of radius .4, open below; within 1e-5 of it."""
    turn = 2 * np.pi * np.arange(_AROUND) / _AROUND
    height = np.pi / 2 * np.arange(_UP) / _UP
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rings = [np.column_stack([np.cos(h) * ring, np.full(_AROUND, np.sin(h))]) for h in height]
    vertices = _RADIUS * np.concatenate([*rings, [[0, 0, 1]]])
    a = np.arange(_AROUND * (_UP - 1)).reshape(_UP - 1, _AROUND)
    b = np.roll(a, -1, axis=1)
    last = _AROUND * (_UP - 1) + np.arange(_AROUND)
    top = np.stack([last, np.roll(last, -1), np.full(_AROUND, _AROUND * _UP)], axis=1)
    sides = [np.stack([a, b, b + _AROUND], axis=-1), np.stack([a, b + _AROUND, a + _AROUND], axis=-1)]
    return Mesh(vertices, np.concatenate([*(side.reshape(-1, 3) for side in sides), top]).astype(np.int32))


def hemisphere_points() -> np.ndarray:
    return surface_points(hemisphere(), _HEMISPHERE, np.random.default_rng(0))


def past_rim(name: str, points: np.ndarray, truth: Mesh) -> list[dict]:
    """u / d past the rim for the points as they are, and with further points on the true rim itself: what is left then
    is the method's own."""
    return [
        _ways(name, "as sampled", points, truth),
        _ways(name, "rim sampled too", np.concatenate([points, rim_points(points, truth)]), truth),
    ]


def rim_points(points: np.ndarray, truth: Mesh) -> np.ndarray:
    """Points on the border of the truth about as far apart as the samples (n,3) are."""
    border, _, _ = border_points(truth, _DRAWN, np.random.default_rng(0))
    apart = _APART * KDTree(points).query(points, 2)[0][:, 1].mean()
    free, kept = np.ones(len(border), bool), []
    for row, near in enumerate(KDTree(border).query_ball_point(border, apart)):
        if free[row]:
            kept.append(row)
            free[near] = False
    return border[kept]


def _ways(name, sampling, points, truth):
    ours = reconstruct(points, FIELD)
    samples, axes = ours.points, ours.normals
    poisson = reconstruct(points, POISSON).field
    ways = {
        "kept": ours.field.sample,
        "poisson": poisson.sample,
        "nearest": lambda x: baselines.nearest_sample(samples, x),
        "none": lambda x: baselines.projection_field(samples, axes, x),
        "discs": lambda x: baselines.discs(samples, axes, x),
        "bracket": lambda x: baselines.bracketed(samples, axes, x),
    }
    probes = rim_probes(ours.field, truth)
    close = near_points(truth, SAMPLES, np.random.default_rng(0))
    true = closest_points(close, truth)[0]
    measured = {
        way: {str(cells): ratios(u(x), distance) for cells, (x, distance) in probes.items()}
        | {"near": 1e3 * np.abs(u(close) - true).mean()}
        for way, u in ways.items()
    }
    spacing = KDTree(points).query(points, 2)[0][:, 1].mean() / ours.field.spacing
    return {"case": name, "sampling": sampling, "points": len(points), "spacing": spacing, "ways": measured}


def rims(cases: list[Case]) -> list[dict]:
    """:func:`past_rim` of a hemisphere and of the cases."""
    shapes = [("hemisphere", hemisphere_points(), hemisphere())]
    shapes += [(case.name, case.points, case.truth) for case in cases]
    return [row for shape in shapes for row in past_rim(*shape)]
