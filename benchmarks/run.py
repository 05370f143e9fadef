"""One case in, one dict of numbers out; many cases, each in a process of its own."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from core import Settings, reconstruct

from . import peers
from .cases import Case, load_case
from .field_metrics import field_errors, past_rims
from .metrics import cover_euler, normal_agreement, surface_errors, topology, triangle_quality


def run_cases(paths: list[Path], sampling: str, settings: Settings, with_peers: bool) -> Iterator[dict]:
    """Results case by case. Each runs in a fresh process, so that its peak memory is its own; one that fails yields
    its name and the error."""
    for path in paths:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            future = pool.submit(run_case, path, sampling, settings, with_peers)
            error = future.exception()
            yield {"case": path.stem, "error": f"{type(error).__name__}: {error}"} if error else future.result()


def run_case(path: Path, sampling: str, settings: Settings, with_peers: bool) -> dict:
    """Reconstruct one case and measure it against its truth; lengths in the case's own scale, nested by subject."""
    case = load_case(path, sampling)
    with peers.Clock() as clock:
        result = reconstruct(case.points, settings)
    rows = result.source_index
    measured = {
        "case": case.name,
        "category": case.meta["category"],
        "licence": case.meta["license"],
        "points": len(case.points),
        "normals": normal_agreement(result.normals, case.normals[rows], case.points[rows], case.nm_curve),
        "field": field_errors(result.field, case.truth, result.points),
        "rims": past_rims(result.field, case.truth),
        "seconds": {**result.report["seconds"], "total": clock.seconds, "cpu": clock.cpu},
        "peak_memory_mb": result.report["peak_memory_mb"],
        "warnings": result.report["warnings"],
    }
    if result.surface is not None:
        measured["mesh"] = _measure_mesh(result.surface, case)
    sheet = reconstruct(case.points, replace(settings, surface="single")).sheet
    measured["sheet"] = {
        **surface_errors(sheet, case.truth),
        **topology(sheet),
        "loops": sheet.border_loops(),
        "euler_expected": topology(case.truth)["euler"],
        "loops_expected": case.truth.border_loops(),
    }
    poisson = reconstruct(case.points, replace(settings, surface="none", integration="poisson")).field
    measured["poisson"] = field_errors(poisson, case.truth, result.points)
    if with_peers:
        measured["peer"] = _measure_peers(case, measured["seconds"])
    return measured


def _measure_mesh(mesh, case):
    found = {**surface_errors(mesh, case.truth), **topology(mesh), **triangle_quality(mesh)}
    expected = cover_euler(case.truth, case.nm_curve)
    found["euler_expected"] = expected
    found["euler_error"] = None if expected is None else abs(found["euler"] - expected)
    return found


def _measure_peers(case: Case, seconds: dict) -> dict:
    """Errors and seconds of the peers, and how our seconds compare: below 1 is faster than the peer."""
    delaunay = peers.delaunay_seconds(case.points)
    mesh, normals, poisson = peers.poisson(case.points)
    return {
        **surface_errors(mesh, case.truth),
        "nc": normal_agreement(normals, case.normals, case.points, case.nm_curve)["nc"],
        "poisson_seconds": poisson.seconds,
        "poisson_cpu": poisson.cpu,
        "delaunay_seconds": delaunay,
        "total_to_poisson": seconds["total"] / poisson.seconds,
        "cpu_to_poisson": seconds["cpu"] / poisson.cpu,
        "normals_to_delaunay": seconds["normals"] / delaunay,
    }
