"""One case in, one dict of numbers out; many cases, some at a time, each part in a process of its own."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from threading import Event

from core import Settings, reconstruct
from core.memory import peak_memory_mb
from core.surface.meshing.quality import triangle_quality

from . import kept
from .against import best_peer
from .alone import FEWEST, MOST, time_alone
from .cases import count_points, load_case
from .field_metrics import field_errors, past_rims
from .measure_peers import measure_peers
from .metrics import cover_euler, normal_agreement, surface_errors, topology
from .peers import PEERS, delaunay_seconds, median_clock, timed
from .processes import Failed, TooSlow, one_thread_each, run_fresh, run_warm
from .repeatability import differences
from .starts import FINE_FROM

PEER_LIMIT = 400.0  # seconds, all ways to start and all variants together
TWICE_UP_TO = 3_000  # points of a case that is measured twice where times are repeated
_MISSING, _TOO_SLOW = "not measured", "too slow"


@dataclass(frozen=True)
class Plan:
    """How cases are measured.

    settings : of our runs
    peers    : whether the peers run, too
    field    : whether the field is measured, beside the one of the paper's Poisson equation
    repeats  : times that whatever takes little is run, for the median; with more than one, cases of up to TWICE_UP_TO
               points are measured twice as a whole
    jobs     : cases measured at a time
    keep     : folder for each part of what is measured, from where a later run goes on; None for none
    until    : time.monotonic() after which no case is begun
    """

    settings: Settings
    peers: bool = False
    field: bool = True
    repeats: int = 1
    jobs: int = 1
    keep: Path | None = None
    until: float = float("inf")


def run_cases(paths: list[Path], sampling: str, plan: Plan) -> Iterator[dict]:
    """Results case by case, in order. A case that fails, or is not begun in time, yields its name and `error`."""
    stop = Event()
    with one_thread_each() if plan.jobs > 1 else nullcontext(), ThreadPoolExecutor(plan.jobs) as pool:
        try:
            yield from pool.map(lambda path: _result(_Parts(path, sampling, plan, stop)), paths)
        finally:
            stop.set()


def time_cases(paths: list[Path], sampling: str, plan: Plan) -> Iterator[tuple[str, dict]]:
    """Names of the cases with about 10,000 points, and what :func:`time_alone` finds of each."""
    for path in paths:
        if FEWEST <= count_points(path, sampling) <= MOST:
            parts, given = _Parts(path, sampling, plan, Event()), (path, sampling, plan.settings, plan.repeats)
            try:
                yield path.stem, parts.measure("alone", kept.ALONE, partial(run_fresh, time_alone, *given))
            except Failed as error:
                yield path.stem, {"error": str(error)}
            except TimeoutError:
                return


def missing(results: list[dict]) -> list[str]:
    """Names of the cases that there was no time for."""
    return [result["case"] for result in results if result.get("error") == _MISSING]


@dataclass(frozen=True)
class _Parts:
    """What is measured of a case, part by part; those that were kept are taken as they are."""

    path: Path
    sampling: str
    plan: Plan
    stop: Event

    def measure(self, name: str, sources: tuple[str, ...], run: Callable[[], dict]) -> dict:
        """Raises :class:`TimeoutError` where time is up, :class:`Failed` where the part fails."""

        def in_time():
            if self.stop.is_set() or time.monotonic() > self.plan.until:
                raise TimeoutError
            return run()

        if self.plan.keep is None:
            return in_time()
        file = self.plan.keep / self.sampling.replace(" ", "_") / f"{self.path.stem}.{name}.json"
        made_of = (
            f"{self.plan.settings} {self.plan.repeats} {self.plan.field} {self.plan.jobs} {PEER_LIMIT} "
            f"{sha256(self.path.read_bytes()).hexdigest()}"
        )
        return kept.once(file, sources, made_of, in_time)

    def whole(self, suffix: str = "") -> dict:
        """Ours and the peers'; the suffix tells one round of it from another."""
        given = self.path, self.sampling, self.plan
        result = self.measure(f"ours{suffix}", kept.OURS, partial(run_fresh, run_case, *given))
        if self.plan.peers:
            result["peers"] = self._peers(suffix)
        return result

    def _peers(self, suffix):
        """What :func:`measure_peers` finds of all that are installed, by name; one that fails has only `error`.
        Where one is too slow, those with the same first step are taken to be so, too."""
        groups, measured, too_slow = {}, {}, set()
        for name, peer in PEERS.items():
            if peer.available:
                groups.setdefault(peer.prepare, []).append(name)
        for names in groups.values():
            given = names, self.path, self.sampling, self.plan.repeats
            run = partial(_in_time_or_not, run_warm, measure_peers, *given, limit=PEER_LIMIT)
            first_step = PEERS[names[0]].first_step
            try:
                if first_step in too_slow:
                    raise TooSlow(f"not begun: {first_step} takes too long")
                found = self.measure(f"{'+'.join(names)}{suffix}", kept.PEERS, run)
                if _TOO_SLOW in found:
                    raise TooSlow(found[_TOO_SLOW])
                measured |= found
            except Failed as error:
                slow = isinstance(error, TooSlow)
                measured |= {name: {"error": str(error), "too_slow": slow} for name in names}
                if slow and first_step:
                    too_slow.add(first_step)
        return measured


def _in_time_or_not(run, *arguments, **limit):
    """What `run` returns, or that it was too slow, which is worth keeping as well."""
    try:
        return run(*arguments, **limit)
    except TooSlow as error:
        return {_TOO_SLOW: str(error)}


def _result(parts):
    try:
        result = parts.whole()
        if parts.plan.repeats > 1 and result["points"] <= TWICE_UP_TO:
            once = replace(parts, plan=replace(parts.plan, repeats=1))
            result["again"] = differences(result, once.whole(" again"))
    except Failed as error:
        return {"case": parts.path.stem, "error": str(error)}
    except TimeoutError:
        return {"case": parts.path.stem, "error": _MISSING}
    if parts.plan.peers:
        result["ratio"] = _ratios(result)
        if best := best_peer(result):
            result["best_peer"] = {"name": best, "cd": result["peers"][best]["cd"]}
    return result


def run_case(path: Path, sampling: str, plan: Plan) -> dict:
    """Reconstruct one case and measure it against its truth; lengths in the case's own scale, nested by subject."""
    case, settings = load_case(path, sampling), plan.settings
    before = peak_memory_mb()
    result, first = timed(reconstruct, case.points, settings)
    clock = median_clock(first, lambda: reconstruct(case.points, settings), plan.repeats)
    memory = result.report["peak_memory_mb"]
    rows = result.source_index
    measured = {
        "case": case.name,
        "category": case.meta["category"],
        "licence": case.meta["license"],
        "points": len(case.points),
        "code": kept.code_version(kept.OURS),
        "normals": normal_agreement(result.normals, case.normals[rows], case.points[rows], case.nm_curve),
        "seconds": {**result.report["seconds"], "total": clock.seconds, "cpu": clock.cpu},
        "peak_memory_mb": memory,
        "memory_mb": memory - before,
        "warnings": result.report["warnings"],
    }
    if result.surface is not None:
        measured["mesh"] = _measure_mesh(result.surface, case)
    single, clock = timed(reconstruct, case.points, replace(settings, surface="single"))
    measured["sheet"] = {
        **surface_errors(single.sheet, case.truth),
        **topology(single.sheet),
        "loops": single.sheet.border_loops(),
        "euler_expected": topology(case.truth)["euler"],
        "loops_expected": case.truth.border_loops(),
        "seconds": clock.seconds,
        "cpu": clock.cpu,
    }
    if len(case.points) >= FINE_FROM:
        fine, clock = timed(reconstruct, case.points, replace(settings, resolution=2 * settings.resolution))
        measured["fine"] = {
            **surface_errors(fine.surface, case.truth),
            "variant": f"{2 * settings.resolution} cells",
            "seconds": clock.seconds,
            "cpu": clock.cpu,
            "memory_mb": fine.report["peak_memory_mb"] - before,
        }
    if plan.field:
        measured["field"] = field_errors(result.field, case.truth, result.points)
        measured["rims"] = past_rims(result.field, case.truth)
        measured["delaunay_seconds"] = delaunay_seconds(case.points)
        poisson = reconstruct(case.points, replace(settings, surface="none", integration="poisson")).field
        measured["poisson"] = field_errors(poisson, case.truth, result.points)
    return measured


def _measure_mesh(mesh, case):
    found = {**surface_errors(mesh, case.truth), **topology(mesh), **triangle_quality(mesh)}
    expected = cover_euler(case.truth, case.nm_curve)
    found["euler_expected"] = expected
    found["euler_error"] = None if expected is None else abs(found["euler"] - expected)
    return found


def _ratios(result):
    """How our times compare: below 1 is faster than the other."""
    seconds, poisson, ratios = result["seconds"], result["peers"].get("poisson", {}), {}
    if "delaunay_seconds" in result:
        ratios["normals_to_delaunay"] = seconds["normals"] / result["delaunay_seconds"]
    if "seconds" in poisson:
        ratios["total_to_poisson"] = seconds["total"] / poisson["seconds"]
        ratios["cpu_to_poisson"] = seconds["cpu"] / poisson["cpu"]
    return ratios
