"""Peers on one case."""

from dataclasses import dataclass
from pathlib import Path

from core import Mesh
from core.memory import peak_memory_mb

from .cases import load_case
from .metrics import surface_errors
from .peers import PEERS, Clock, median_clock, timed
from .starts import Start, readied, starts

_TRIAL_SAMPLES = 10_000  # a side, to choose a start and a variant by
_FAILURES = (RuntimeError, ValueError)


def measure_peers(names: list[str], path: Path, sampling: str, repeats: int) -> dict[str, dict]:
    """Errors, time and memory of peers that start alike, by name; one that always fails has only the key `error`.

    Of the ways to start and of a peer's variants those with the lowest CD count, chosen with the truth at hand.

    seconds, cpu : the preparation plus the rest with that variant, either of median time
    memory_mb    : what the first preparation and all variants after it, of all of these peers, added to the memory of
                   the process
    variant      : how it started and the parameter chosen, as text
    """
    case, peer = load_case(path, sampling), PEERS[names[0]]
    before = peak_memory_mb()
    memory, tried, failed = None, {name: [] for name in names}, {}
    for start in starts(case.meta["category"], len(case.points), peer.normals, peer.octree):
        try:
            prepared, preparing = timed(_prepared, peer, case.points, start)
        except _FAILURES as error:
            failed = dict.fromkeys(names, error) | failed
            continue
        for name in names:
            for variant in PEERS[name].variants:
                try:
                    mesh, clock = timed(PEERS[name].finish, prepared, variant)
                    if not len(mesh.faces):
                        raise ValueError("it made no triangle")
                    tried[name].append(_Trial(start, variant, mesh, prepared, preparing, clock))
                except _FAILURES as error:
                    failed.setdefault(name, error)
        if memory is None:
            memory = peak_memory_mb() - before
    return {
        name: _measured(name, trials, case, repeats, memory) if trials else {"error": _line(failed[name])}
        for name, trials in tried.items()
    }


@dataclass(frozen=True)
class _Trial:
    """A peer's mesh, what it was made of, and the time of either part."""

    start: Start
    variant: object
    mesh: Mesh
    prepared: object
    preparing: Clock
    clock: Clock


def _prepared(peer, points, start):
    return peer.prepare(readied(points, start), start)


def _measured(name, trials, case, repeats, memory):
    peer, best = PEERS[name], trials[0]
    if len(trials) > 1:
        best = min(trials, key=lambda trial: surface_errors(trial.mesh, case.truth, count=_TRIAL_SAMPLES)["cd"])
    preparing = median_clock(best.preparing, lambda: _prepared(peer, case.points, best.start), repeats)
    clock = median_clock(best.clock, lambda: peer.finish(best.prepared, best.variant), repeats)
    return {
        **surface_errors(best.mesh, case.truth),
        "variant": "; ".join(filter(None, (str(best.start), _text(best.variant)))) or None,
        "seconds": preparing.seconds + clock.seconds,
        "cpu": preparing.cpu + clock.cpu,
        "memory_mb": memory,
    }


def _text(variant):
    return "" if variant is None else str(variant).strip("()[]")


def _line(error):
    return f"{type(error).__name__}: {error}"
