"""One case in, one dict of numbers out; many cases, each in a process of its own."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from core import Settings, reconstruct
from core.memory import peak_memory_mb
from core.surface.quality import triangle_quality

from . import peers
from .against import best_peer
from .cases import load_case
from .field_metrics import field_errors, past_rims
from .measure_peers import measure_peers
from .metrics import cover_euler, normal_agreement, surface_errors, topology
from .processes import Failed, run_fresh, run_warm

PEER_LIMIT = 600.0  # seconds, all variants together


def run_cases(
    paths: list[Path], sampling: str, settings: Settings, with_peers: bool, repeats: int = 1
) -> Iterator[dict]:
    """Results case by case. We and the peers run in processes of our own; one that fails yields its name and the
    error."""
    for path in paths:
        try:
            result = run_fresh(run_case, path, sampling, settings, repeats)
        except Failed as error:
            yield {"case": path.stem, "error": str(error)}
            continue
        if with_peers:
            result["peers"] = run_peers(path, sampling, repeats)
            result["ratio"] = _ratios(result)
            if best := best_peer(result):
                result["best_peer"] = {"name": best, "cd": result["peers"][best]["cd"]}
        yield result


def run_peers(path: Path, sampling: str, repeats: int = 1) -> dict[str, dict]:
    """What :func:`measure_peers` finds of all that are installed, by name; one that fails has only the key `error`."""
    groups, measured = {}, {}
    for name, peer in peers.PEERS.items():
        if peer.available:
            groups.setdefault(peer.prepare, []).append(name)
    for names in groups.values():
        try:
            measured |= run_warm(measure_peers, names, path, sampling, repeats, limit=PEER_LIMIT)
        except Failed as error:
            measured |= {name: {"error": str(error)} for name in names}
    return measured


def run_case(path: Path, sampling: str, settings: Settings, repeats: int = 1) -> dict:
    """Reconstruct one case and measure it against its truth; lengths in the case's own scale, nested by subject."""
    case = load_case(path, sampling)
    before = peak_memory_mb()
    result, clock = _reconstruct(case, settings)
    clock, stages = _median([(clock, result), *(_reconstruct(case, settings)[::-1] for _ in range(repeats - 1))])
    rows = result.source_index
    measured = {
        "case": case.name,
        "category": case.meta["category"],
        "licence": case.meta["license"],
        "points": len(case.points),
        "normals": normal_agreement(result.normals, case.normals[rows], case.points[rows], case.nm_curve),
        "field": field_errors(result.field, case.truth, result.points),
        "rims": past_rims(result.field, case.truth),
        "seconds": {**stages, "total": clock.seconds, "cpu": clock.cpu},
        "peak_memory_mb": result.report["peak_memory_mb"],
        "memory_mb": result.report["peak_memory_mb"] - before,
        "delaunay_seconds": peers.delaunay_seconds(case.points),
        "warnings": result.report["warnings"],
    }
    if result.surface is not None:
        measured["mesh"] = _measure_mesh(result.surface, case)
    single, clock = _reconstruct(case, replace(settings, surface="single"))
    measured["sheet"] = {
        **surface_errors(single.sheet, case.truth),
        **topology(single.sheet),
        "loops": single.sheet.border_loops(),
        "euler_expected": topology(case.truth)["euler"],
        "loops_expected": case.truth.border_loops(),
        "seconds": clock.seconds,
        "cpu": clock.cpu,
    }
    poisson = reconstruct(case.points, replace(settings, surface="none", integration="poisson")).field
    measured["poisson"] = field_errors(poisson, case.truth, result.points)
    return measured


def _reconstruct(case, settings):
    with peers.Clock() as clock:
        result = reconstruct(case.points, settings)
    return result, clock


def _median(runs):
    """Clock and seconds per stage of the run of median time, the lower of two."""
    runs = sorted(runs, key=lambda run: run[0].seconds)
    clock, result = runs[(len(runs) - 1) // 2]
    return clock, result.report["seconds"]


def _measure_mesh(mesh, case):
    found = {**surface_errors(mesh, case.truth), **topology(mesh), **triangle_quality(mesh)}
    expected = cover_euler(case.truth, case.nm_curve)
    found["euler_expected"] = expected
    found["euler_error"] = None if expected is None else abs(found["euler"] - expected)
    return found


def _ratios(result):
    """How our times compare: below 1 is faster than the other."""
    seconds, poisson = result["seconds"], result["peers"].get("poisson", {})
    ratios = {"normals_to_delaunay": seconds["normals"] / result["delaunay_seconds"]}
    if "seconds" in poisson:
        ratios["total_to_poisson"] = seconds["total"] / poisson["seconds"]
        ratios["cpu_to_poisson"] = seconds["cpu"] / poisson["cpu"]
    return ratios
