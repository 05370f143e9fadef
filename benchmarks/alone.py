"""Our time against that of the common route, PCA normals with orientation and Poisson, with nothing beside them."""

import os
from pathlib import Path

from core import Settings, reconstruct

from .cases import load_case
from .peers import Clock, poisson

WITHIN = 1.5  # times the other's time, at most
FEWEST, MOST = 9_000, 11_000  # points of the cases that this is asked on


def time_alone(path: Path, sampling: str, settings: Settings, repeats: int) -> dict:
    """Median `seconds` and `cpu` seconds of both, run in turn `repeats` times: {"ours", "poisson"}; `load`, the mean
    number of processes at work on the machine in the minute before; and the ratios of the medians."""
    points = load_case(path, sampling).points
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    ours, others = [], []
    for _ in range(repeats):
        with Clock() as clock:
            reconstruct(points, settings)
        ours.append(clock)
        others.append(poisson(points)[2])
    times = {name: _medians(clocks) for name, clocks in (("ours", ours), ("poisson", others))}
    ratio = {key: times["ours"][key] / times["poisson"][key] for key in ("seconds", "cpu")}
    return {"points": len(points), "load": load, **times, "ratio": ratio}


def _medians(clocks):
    middle = (len(clocks) - 1) // 2
    return {key: sorted(getattr(clock, key) for clock in clocks)[middle] for key in ("seconds", "cpu")}
