"""Errors of the field beside those of simpler distances, case by case and by the number of points."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from core import DistanceField, Mesh, Settings, SettingsError, reconstruct
from core.normals.pca import pca_normals

from . import field_baselines as baselines
from .cases import Case, load_case
from .field_metrics import SAMPLES, box_points, near_points
from .geometry import closest_points, surface_points
from .peers import poisson as open3d_poisson

FIELD = Settings(surface="none")
POISSON = replace(FIELD, integration="poisson")
GRID = replace(POISSON, diffusion="grid")
DENSITIES = 500, 1_000, 2_000, 5_000, 10_000, 50_000
SLICED = 500, 2_000, 10_000


def case_fields(path: Path, sampling: str) -> dict:
    """Mean |u - d| of every method, x1e3: over points uniform in the box, over points within .05 of the surface (near),
    and over the nodes of the grid next to the latter, where reading the field costs nothing (nodes).

    `grid`, the paper's diffusion on the grid, is None where the grid or float64 cannot hold it; `exact` is what the
    grid itself costs, see :func:`read_from_nodes`.
    """
    case = load_case(path, sampling)
    ours = reconstruct(case.points, FIELD)
    probes = _probes(ours.field, case.truth)
    found = {"ours": ours.field.sample, "poisson": reconstruct(case.points, POISSON).field.sample}
    try:
        found["grid"] = reconstruct(case.points, GRID).field.sample
    except SettingsError:
        found["grid"] = None
    found |= _simpler(ours.points, ours.normals, case.points)
    found["exact"] = lambda x: read_from_nodes(ours.field, case.truth, x)
    mesh = open3d_poisson(case.points)[0]
    found["open3d"] = lambda x: closest_points(x, mesh)[0]
    return {"case": case.name, "category": case.meta["category"], **_errors(found, probes)}


def densities(case: Case) -> Iterator[dict]:
    """The same for DENSITIES points of the case's true surface, uniform by area: with diffusion and without."""
    for count in DENSITIES:
        points = surface_points(case.truth, count, np.random.default_rng(0))
        ours = reconstruct(points, FIELD)
        found = {"ours": ours.field.sample, "poisson": reconstruct(points, POISSON).field.sample}
        found |= _simpler(ours.points, ours.normals, points)
        yield {"case": case.name, "points": count, **_errors(found, _probes(ours.field, case.truth))}


def density_slices(case: Case, nodes: np.ndarray) -> dict:
    """At positions (m,3): the true distance, and for SLICED points of the true surface u without diffusion and ours."""
    rows = {"projection": [], "ours": []}
    for count in SLICED:
        points = surface_points(case.truth, count, np.random.default_rng(0))
        ours = reconstruct(points, FIELD)
        rows["projection"].append(baselines.projection_field(ours.points, ours.normals, nodes))
        rows["ours"].append(ours.field.sample(nodes))
    return {"truth": closest_points(nodes, case.truth)[0], **rows}


def read_from_nodes(field: DistanceField, truth: Mesh, x: np.ndarray) -> np.ndarray:
    """The true distance as the field's grid could hold it at best: exact at its nodes, interpolated at x (m,3)."""
    shape = np.array(field.values.shape)
    base = np.clip(np.floor((x - field.origin) / field.spacing).astype(int), 0, shape - 2)
    corners = base[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T
    nodes = np.unique(np.ravel_multi_index(corners.reshape(-1, 3).T, shape))
    values = np.zeros(shape, np.float32)
    at = field.origin + field.spacing * np.stack(np.unravel_index(nodes, shape), axis=1)
    values.flat[nodes] = closest_points(at, truth)[0]
    return DistanceField(values, field.origin, field.spacing).sample(x)


def _simpler(points, axes, given):
    """Distances without a field; the projection field takes our axes, the others a plane fit to the given points."""
    planes, _ = pca_normals(given, baselines.PLANE_NEIGHBOURS)
    return {
        "projection": lambda x: baselines.projection_field(points, axes, x),
        "nearest": lambda x: baselines.nearest_sample(given, x),
        "planes": lambda x: baselines.projection_field(given, planes, x),
        "blended": lambda x: baselines.blended_planes(given, planes, x),
    }


def _probes(field: DistanceField, truth: Mesh):
    rng = np.random.default_rng(0)
    probes = {"box": box_points(field, SAMPLES, rng), "near": near_points(truth, SAMPLES, rng)}
    node = np.unique(np.rint((probes["near"] - field.origin) / field.spacing), axis=0)
    probes["nodes"] = field.origin + field.spacing * np.clip(node, 0, np.array(field.values.shape) - 1)
    return {where: (x, closest_points(x, truth)[0]) for where, x in probes.items()}


def _errors(found, probes):
    return {
        name: distance and {where: 1e3 * np.abs(distance(x) - true).mean() for where, (x, true) in probes.items()}
        for name, distance in found.items()
    }
