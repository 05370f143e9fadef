"""How long a run goes without looking whether it has been cancelled."""

import time
from collections import defaultdict
from itertools import pairwise

import numpy as np

from core import Settings, reconstruct


def silences(points: np.ndarray, settings: Settings) -> dict[str, dict]:
    """For every stage the number of looks and the longest time between two of them: by the clock, and in CPU seconds of
    all threads, which other work on the machine leaves alone. A silence counts for the stage of the look before it."""
    looks = [(time.perf_counter(), time.process_time(), "start")]
    reconstruct(
        points,
        settings,
        progress=lambda fraction, stage: looks.append((time.perf_counter(), time.process_time(), stage)),
    )
    looks.append((time.perf_counter(), time.process_time(), "end"))
    stages = defaultdict(lambda: {"looks": 0, "seconds": 0.0, "cpu": 0.0})
    for (seconds, cpu, stage), (seconds_after, cpu_after, _) in pairwise(looks):
        found = stages[stage or "report"]
        found["looks"] += 1
        found["seconds"] = max(found["seconds"], seconds_after - seconds)
        found["cpu"] = max(found["cpu"], cpu_after - cpu)
    return dict(stages)
