"""How soon a run that is cancelled stops, and how long its work goes on without a look."""

import threading
import time
from collections import defaultdict

import numpy as np

from core import Cancelled, Settings, reconstruct

POINTS, NOISE = 100_000, 0.01
RUNS = {
    "128³, both": (0.0, Settings(surface="both")),
    "128³, both, noisy": (NOISE, Settings(surface="both")),
    "128³, signed": (0.0, Settings(surface="signed")),
    "256³, both": (0.0, Settings(surface="both", resolution=256)),
    "512³, band 4": (0.0, Settings(resolution=512, band=4)),
}
STOPS = {"128³, both": 6, "512³, band 4": 2}  # cancels of a run, evenly spread over its time

_GONE = 60.0  # seconds after which the work of a cancelled run counts as hung


def sphere(deviation: float) -> np.ndarray:
    """(100000,3) points of the unit sphere with Gaussian noise."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(POINTS, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points + deviation * rng.normal(size=points.shape)


def silences(points: np.ndarray, settings: Settings) -> dict[str, dict]:
    """For every stage the number of looks, the longest CPU time of all threads between two of them, seconds, and the
    longest time by the clock between two calls of the callback, which hears the last look again where there is no new
    one for long. A silence counts for the stage of the look before it."""
    stages = defaultdict(lambda: {"looks": 0, "seconds": 0.0, "cpu": 0.0})
    last = {"call": time.perf_counter(), "look": time.process_time(), "report": (0.0, "start")}

    def hear(*report):
        found, now, cpu = stages[last["report"][1] or "report"], time.perf_counter(), time.process_time()
        found["seconds"] = max(found["seconds"], now - last["call"])
        last["call"] = now
        if report != last["report"]:
            found["looks"] += 1
            found["cpu"] = max(found["cpu"], cpu - last["look"])
            last["look"], last["report"] = cpu, report

    reconstruct(points, settings, progress=hear)
    hear(None, "end")
    return dict(stages)


def stops(points: np.ndarray, settings: Settings, length: float, count: int) -> list[dict]:
    """Runs of about `length` seconds, cancelled after each of `count` shares of that: when, and the seconds until the
    call was back and until no thread of it was left."""
    return [_stop(points, settings, (turn + 0.5) / count * length) for turn in range(count)]


def _stop(points, settings, after):
    before, begun, asked = threading.active_count(), time.perf_counter(), []

    def cancel(*_):
        if time.perf_counter() - begun < after:
            return True
        asked.append(time.perf_counter())
        return False

    found = {"after": after, "stopped": 0.0, "gone": 0.0}
    try:
        reconstruct(points, settings, progress=cancel)
    except Cancelled:
        due = min(asked[0], begun + after)
        found["stopped"] = time.perf_counter() - due
        while threading.active_count() > before and time.perf_counter() - due < _GONE:
            time.sleep(0.01)
        found["gone"] = time.perf_counter() - due
    return found
