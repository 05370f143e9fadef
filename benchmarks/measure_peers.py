"""Peers on one case."""

from pathlib import Path

from core.memory import peak_memory_mb

from .cases import load_case
from .metrics import surface_errors
from .peers import PEERS, median_clock, timed

_TRIAL_SAMPLES = 10_000  # a side, to choose a variant by
_FAILURES = (RuntimeError, ValueError)


def measure_peers(names: list[str], path: Path, sampling: str, repeats: int) -> dict[str, dict]:
    """Errors, time and memory of peers that start alike, by name; one that fails has only the key `error`.

    Of a peer's variants the one with the lowest CD counts, chosen with the truth at hand.

    seconds, cpu : the preparation plus the rest with that variant, either of median time
    memory_mb    : what the preparation and all variants of all of these peers added to the memory of the process
    variant      : the parameter chosen, None where there is none
    """
    case, prepare = load_case(path, sampling), PEERS[names[0]].prepare
    before = peak_memory_mb()
    prepared, preparing = timed(prepare, case.points)
    trials = {name: _tried(PEERS[name], prepared) for name in names}
    memory = peak_memory_mb() - before
    preparing = median_clock(preparing, lambda: prepare(case.points), repeats)
    measured = {}
    for name, tried in trials.items():
        try:
            variant, mesh, clock = _best(tried, case.truth)
        except _FAILURES as error:
            measured[name] = {"error": f"{type(error).__name__}: {error}"}
            continue
        clock = median_clock(clock, lambda: PEERS[name].finish(prepared, variant), repeats)  # noqa: B023 - called here
        measured[name] = {
            **surface_errors(mesh, case.truth),
            "variant": variant,
            "seconds": preparing.seconds + clock.seconds,
            "cpu": preparing.cpu + clock.cpu,
            "memory_mb": memory,
        }
    return measured


def _tried(peer, prepared):
    """(variant, mesh, clock) of every variant, or the error that one of them ended with."""
    try:
        return [(variant, *timed(peer.finish, prepared, variant)) for variant in peer.variants]
    except _FAILURES as error:
        return error


def _best(tried, truth):
    """The one of `tried` with the lowest CD. Raises what :func:`_tried` met, or ValueError where there is no mesh."""
    if isinstance(tried, Exception):
        raise tried
    made = [trial for trial in tried if len(trial[1].faces)]
    if not made:
        raise ValueError("it made no triangle")
    if len(made) == 1:
        return made[0]
    return min(made, key=lambda trial: surface_errors(trial[1], truth, count=_TRIAL_SAMPLES)["cd"])
