"""Peers on one case."""

from pathlib import Path

from core.memory import peak_memory_mb

from .cases import load_case
from .metrics import surface_errors
from .peers import PEERS, Clock

_TRIAL_SAMPLES = 10_000  # a side, to choose a variant by


def measure_peers(names: list[str], path: Path, sampling: str, repeats: int) -> dict[str, dict]:
    """:func:`_measure` of peers that start alike, by name; one that fails has only the key `error`."""
    case = load_case(path, sampling)
    before = peak_memory_mb()
    prepare = PEERS[names[0]].prepare
    start = _timed(prepare, case.points)
    again = [_timed(prepare, case.points) for _ in range(repeats - 1)]
    measured = {}
    for name in names:
        try:
            measured[name] = _measure(PEERS[name], case, [start, *again], before)
        except (RuntimeError, ValueError) as error:
            measured[name] = {"error": f"{type(error).__name__}: {error}"}
    return measured


def _measure(peer, case, starts, before):
    """Errors, time and memory of a peer; of its variants the one with the lowest CD, chosen with the truth at hand.

    seconds, cpu : of the run of median time with that variant, preparation included
    memory_mb    : what the preparations and all variants added to the memory of the process
    variant      : the parameter chosen, None where there is none
    """
    trials = [(variant, *_timed(peer.finish, starts[0][0], variant)) for variant in peer.variants]
    memory = peak_memory_mb() - before
    trials = [trial for trial in trials if len(trial[1].faces)]
    if not trials:
        raise ValueError("it made no triangle")
    if len(trials) > 1:
        trials.sort(key=lambda trial: surface_errors(trial[1], case.truth, count=_TRIAL_SAMPLES)["cd"])
    variant, mesh, finishing = trials[0]
    finishes = [finishing, *(_timed(peer.finish, prepared, variant)[1] for prepared, _ in starts[1:])]
    times = sorted((s.seconds + f.seconds, s.cpu + f.cpu) for (_, s), f in zip(starts, finishes, strict=True))
    seconds, cpu = times[(len(times) - 1) // 2]
    return {
        **surface_errors(mesh, case.truth),
        "variant": variant,
        "seconds": seconds,
        "cpu": cpu,
        "memory_mb": memory,
    }


def _timed(function, *arguments):
    with Clock() as clock:
        result = function(*arguments)
    return result, clock
