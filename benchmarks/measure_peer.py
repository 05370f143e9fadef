"""One peer on one case."""

from pathlib import Path

from core.memory import peak_memory_mb

from .cases import load_case
from .metrics import surface_errors
from .peers import PEERS, Clock

_TRIAL_SAMPLES = 20_000  # a side, to choose a variant by


def measure_peer(name: str, path: Path, sampling: str, repeats: int) -> dict:
    """Errors, time and memory of a peer; of its variants the one with the lowest CD, chosen with the truth at hand.

    seconds, cpu : of the run of median time, of `repeats` with that variant
    memory_mb    : what the first run of all variants added to the memory of the process
    variant      : the parameter chosen, None where there is none
    """
    peer, case = PEERS[name], load_case(path, sampling)
    before = peak_memory_mb()
    prepared, preparing = _timed(peer.prepare, case.points)
    trials = [(variant, *_timed(peer.finish, prepared, variant)) for variant in peer.variants]
    memory = peak_memory_mb() - before
    trials = [trial for trial in trials if len(trial[1].faces)]
    if not trials:
        raise ValueError("it made no triangle")
    if len(trials) > 1:
        trials.sort(key=lambda trial: surface_errors(trial[1], case.truth, count=_TRIAL_SAMPLES)["cd"])
    variant, mesh, finishing = trials[0]
    times = [_sum(preparing, finishing)]
    for _ in range(repeats - 1):
        prepared, preparing = _timed(peer.prepare, case.points)
        times.append(_sum(preparing, _timed(peer.finish, prepared, variant)[1]))
    seconds, cpu = sorted(times)[(len(times) - 1) // 2]
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


def _sum(first, second):
    return first.seconds + second.seconds, first.cpu + second.cpu
