"""What the axes cost: time and memory against SciPy's Delaunay alone, and how both grow."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay

from core.memory import peak_memory_mb
from core.normals.estimate import swept_normals
from core.normals.mirrors import Mirrors
from core.points import local_spacing, prepare_samples
from core.voronoi.facets import voronoi_facets

from .cases import load_case
from .geometry import surface_points
from .peers import Clock

COUNTS = 1_000, 3_000, 10_000, 30_000, 100_000, 1_000_000
REPEATED_UP_TO = 100_000  # points; larger runs are measured once
_REPEATS = 3
_SMALL = 5_000  # points; up to here fixed costs show


def costs(path: Path, counts=COUNTS) -> Iterator[dict]:
    """:func:`stage_cost` for each number of points, each in a fresh process, so that its peak memory is its own."""
    for count in counts:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            yield pool.submit(stage_cost, path, count).result()


def stage_cost(path: Path, count: int) -> dict:
    """Facets and sweeps on `count` points of the case's true surface, in random order, and Delaunay alone on the same.

    stage_cpu, facets_cpu, delaunay_cpu, stage_seconds, delaunay_seconds : best of three (up to REPEATED_UP_TO points)
    peak_memory_mb : of the process after the stage, before Delaunay alone
    """
    case = load_case(path)
    points = prepare_samples(surface_points(case.truth, count, np.random.default_rng(0))).points
    spacing = local_spacing(points)
    repeats = _REPEATS if count <= REPEATED_UP_TO else 1
    stages = [_stage(points, spacing) for _ in range(repeats)]
    peak = peak_memory_mb()
    alone = [_delaunay(points) for _ in range(repeats)]
    return {
        "points": count,
        "stage_cpu": min(facets.cpu + sweeps.cpu for facets, sweeps in stages),
        "facets_cpu": min(facets.cpu for facets, _ in stages),
        "stage_seconds": min(facets.seconds + sweeps.seconds for facets, sweeps in stages),
        "delaunay_cpu": min(clock.cpu for clock in alone),
        "delaunay_seconds": min(clock.seconds for clock in alone),
        "peak_memory_mb": peak,
    }


def _stage(points, spacing):
    with Clock() as building:
        facets = voronoi_facets(points, spacing)
    with Clock() as sweeping:
        mirrors = Mirrors(points, spacing, facets)
        swept_normals(points, spacing, mirrors)
    return building, sweeping


def _delaunay(points):
    with Clock() as clock:
        Delaunay(points)
    return clock


def exponent(measured: list[dict], key: str) -> float:
    """p of the power law count^p through the value `key` of the larger runs, by least squares of the logarithms."""
    large = [(run["points"], run[key]) for run in measured if run["points"] > _SMALL]
    return float(np.polyfit(*np.log(np.array(large)).T, 1)[0])
