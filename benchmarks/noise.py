"""Noise and stray points added to clean cases: `python -m benchmarks.noise FOLDER [--cases A,B]`, Markdown on stdout.

Every row is one run with default settings. Distances x1e3; PCA is the best of eight neighbourhoods chosen with the true
normals at hand, on the points as they come.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from core import Settings, reconstruct
from core.normals.pca import pca_normals

from .cases import Case, find_cases, load_case
from .geometry import closest_points
from .metrics import surface_errors
from .peers import Clock
from .status import DONE, exit_status

NOISE = (0.0, 0.1, 0.5, 1.0, 1.5)  # per cent of the longest side
STRAYS = (0.05, 0.2)  # per sample
_PCA = (6, 8, 12, 16, 24, 36, 48, 80)
_MARGIN = 1.1  # strays fill the box of the object, this much enlarged
_COLUMNS = ("case", "dirt", "distance before", "after", "NC", "PCA", "CD", "HD", "samples", "seconds")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.noise", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=lambda text: text.split(","), help="only these (default: all)")
    given = parser.parse_args(arguments)

    def command():
        print(f"| {' | '.join(_COLUMNS)} |\n|{'---|' * len(_COLUMNS)}")
        for path in find_cases(given.folder, given.cases):
            case = load_case(path)
            for dirt, points in dirty(case):
                print(_row(case, dirt, points), flush=True)
        return DONE

    return exit_status(command)


def dirty(case: Case, seed: int = 0):
    """Names and points (m,3), m >= n, of a case made noisy or strewn with strays; the first n rows are its own."""
    rng = np.random.default_rng(seed)
    low, high = case.points.min(axis=0), case.points.max(axis=0)
    for percent in NOISE:
        deviation = 0.01 * percent * (high - low).max()
        yield f"noise {percent} %", case.points + rng.normal(size=case.points.shape) * deviation
    for share in STRAYS:
        spread = rng.uniform(-0.5, 0.5, (int(share * len(case.points)), 3)) * _MARGIN * (high - low)
        yield f"strays {share:.0%}", np.vstack([case.points, (low + high) / 2 + spread])


def _row(case, dirt, points):
    with Clock() as clock:
        result = reconstruct(points, Settings())
    own = result.source_index < len(case.points)
    before, after = (1e3 * closest_points(x, case.truth)[0].mean() for x in (points, result.points))
    agreement = _agreement(result.normals[own], case.normals[result.source_index[own]])
    best = max(_agreement(pca_normals(points, k)[0][: len(case.points)], case.normals) for k in _PCA)
    errors = surface_errors(result.surface, case.truth)
    figures = f"{before:.2f} | {after:.2f} | {agreement:.4f} | {best:.4f} | {errors['cd']:.3f} | {errors['hd']:.1f}"
    return f"| {case.name} | {dirt} | {figures} | {len(result.points)} | {clock.seconds:.1f} |"


def _agreement(axes, true_normals):
    return np.abs(np.einsum("ni,ni->n", axes, true_normals)).mean()


if __name__ == "__main__":
    sys.exit(main())
