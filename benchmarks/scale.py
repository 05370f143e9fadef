"""docs/scale.md: `python -m benchmarks.scale FOLDER` measures how cost grows with the grid and with the points, and how
surfaces come closer on finer grids."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core import Settings, reconstruct
from core.budget import SUITED
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report
from core.memory import peak_memory_mb

from . import detail
from .cases import find_cases, load_case
from .geometry import surface_points
from .peers import Clock, check_open3d, load_open3d, poisson
from .processes import run_fresh
from .status import DOCS, page_command, word
from .tables import markdown_rows
from .versions import listed, versions

SHAPE = "spot_10k"
POINTS = 100_000
RUNS = (  # points, resolution, band, surface
    (POINTS, 128, None, "double"),
    (POINTS, 256, None, "double"),
    (POINTS, 256, 4, "double"),
    (POINTS, 512, 4, "double"),
    (POINTS, 1024, 4, "double"),
    (10_000, 512, 4, "double"),
    (30_000, 512, 4, "double"),
    (POINTS, 512, 4, "single"),
    (POINTS, 512, 4, "signed"),
)
GRIDS, COUNTS = (512, 1024), (10_000, 30_000, POINTS)  # that the growth is read from
TARGET_MEMORY, TARGET_GROWTH = 4.0, 2.3  # GiB; exponent in the resolution
_LIBRARIES = "numpy", "scipy", "open3d"

_PAGE = """\
# Large grids

Made by `python -m benchmarks.scale FOLDER`, which writes this page and the numbers behind it
([numbers.json](scale/numbers.json)); do not edit it by hand. {versions}.

Points of the true surface of {shape}, uniform by area; every other setting at its default but `denoise=0`, which
takes the time of the noise estimate out. Each row is a whole run, from points to meshes, in a process of its own. *CPU*
is the sum over all threads, the figure to trust where other work shares the machine; *peak* is the resident memory of
the process beyond what its libraries take. *Open3D* is, on the same points in the same run, `estimate_normals`,
tangent-plane orientation and Poisson at depth 8 (at its finest a grid of 256^3), which gives a surface and no field.

## What is met and what is not

{verdicts}

## Runs

{runs}

## Growth

From resolution {coarse} to {fine}, {points:,} points in a band of 4 cells, CPU time grows as the resolution to the
power of **{field:.2f}** (field) and **{total:.2f}** (whole run), memory as **{memory:.2f}**: the surface has four times
as many cells, the box eight times as many. From {few:,} to {points:,} points at {coarse} CPU time of the whole run
grows as the number of points to the power of **{by_points:.2f}**.

{open3d}

## Which resolution

Chamfer distance × 10³ of the double cover where the points of a case are so many cells apart in the median, and
in brackets the resolution for that. In bold: {suited:g} cells, whose resolution `info` and Estimate Cost say suits the
points. {closer}

{detail}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    return page_command(
        arguments,
        "scale",
        "Measure runs on large grids, in the whole box and in bands, and write docs/scale.md.",
        f"holds the cases {', '.join(detail.CASES)}",
        lambda folder: write_page(measure(folder), DOCS),
    )


def measure(folder: Path) -> dict:
    """Everything that the page shows, printing what is done as it finishes."""
    check_open3d()
    (path,), cases = find_cases(folder, [SHAPE]), find_cases(folder, detail.CASES)
    return {
        "versions": versions(_LIBRARIES),
        "runs": list(_said(run_cost, path, RUNS)),
        "open3d": list(_said(open3d_cost, path, [(count,) for count in COUNTS])),
        "detail": [row for case in cases for row in _said(detail.detail, case, [(apart,) for apart in detail.APART])],
    }


def _said(function, path, rows) -> Iterator[dict]:
    for row in rows:
        print(function.__name__, path.stem, *row, flush=True)
        yield run_fresh(function, path, *row)


def run_cost(path: Path, count: int, resolution: int, band: float | None, surface: str) -> dict:
    """Seconds, CPU seconds and memory of one run on `count` points of the case's true surface."""
    points = surface_points(load_case(path).truth, count, np.random.default_rng(0))
    settings = Settings(resolution=resolution, band=band, surface=surface, denoise=0.0, memory_limit=2.0**22)
    before, watch = peak_memory_mb(), _Watch()
    with Clock() as clock:
        result = reconstruct(points, settings, progress=watch)
    return {
        "points": count,
        "resolution": resolution,
        "band": band,
        "surface": surface,
        "seconds": clock.seconds,
        "cpu": clock.cpu,
        "field_cpu": watch.cpu["distance field"],
        "peak_memory_mb": peak_memory_mb() - before,
        "nodes": result.report["counts"]["nodes"],
        "box": int(np.prod(result.field.shape)),
        "faces": len((result.surface or result.sheet).faces),
        "estimate": result.report["estimate"],
    }


class _Watch:
    """Progress callback that adds up the CPU seconds of each stage."""

    def __init__(self):
        self.cpu, self._stage, self._clock = {}, None, Clock().__enter__()

    def __call__(self, fraction, stage):
        if stage != self._stage:
            self._clock.__exit__()
            self.cpu[self._stage] = self.cpu.get(self._stage, 0.0) + self._clock.cpu
            self._stage, self._clock = stage, Clock().__enter__()


def open3d_cost(path: Path, count: int) -> dict:
    """The same for Open3D's normals, orientation and Poisson surface."""
    points = surface_points(load_case(path).truth, count, np.random.default_rng(0))
    load_open3d()
    before = peak_memory_mb()
    _, _, clock = poisson(points)
    return {
        "points": count,
        "seconds": clock.seconds,
        "cpu": clock.cpu,
        "peak_memory_mb": peak_memory_mb() - before,
    }


def write_page(measured: dict, docs: Path) -> Path:
    """Write scale.md and the numbers into the folder `docs`. Returns the page."""
    page = docs / "scale.md"
    write_report(writable_folder(docs / "scale") / "numbers.json", measured)
    coarse, fine = (_run(measured, POINTS, grid, 4, "double") for grid in GRIDS)
    few, many = (_run(measured, count, GRIDS[0], 4, "double") for count in (COUNTS[0], COUNTS[-1]))
    text = _PAGE.format(
        versions=listed(measured["versions"]),
        shape=SHAPE,
        verdicts="\n".join(f"- {line}" for line in verdicts(measured)),
        runs=_runs(measured),
        coarse=GRIDS[0],
        fine=GRIDS[1],
        points=POINTS,
        few=COUNTS[0],
        field=_exponent(coarse, fine, "resolution", "field_cpu"),
        total=_exponent(coarse, fine, "resolution", "cpu"),
        memory=_exponent(coarse, fine, "resolution", "peak_memory_mb"),
        by_points=_exponent(few, many, "points", "cpu"),
        open3d=_open3d(measured),
        suited=SUITED,
        detail=detail.detail_table(measured["detail"]),
        closer=detail.detail_verdict(measured["detail"]),
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def verdicts(measured: dict) -> Iterator[str]:
    """A line for each target: what is asked, what came out."""
    for resolution, band in ((256, None), (512, 4)):
        peak = _run(measured, POINTS, resolution, band, "double")["peak_memory_mb"] / 2**10
        where = "in the whole box" if band is None else f"in a band of {band} cells"
        yield (
            f"{word(peak <= TARGET_MEMORY)}: {POINTS:,} points at {resolution}^3 {where} peak at {peak:.2f} GiB "
            f"(at most {TARGET_MEMORY:g} is asked)."
        )
    coarse, fine = (_run(measured, POINTS, grid, 4, "double") for grid in GRIDS)
    growth = _exponent(coarse, fine, "resolution", "cpu")
    yield (
        f"{word(growth <= TARGET_GROWTH)}: in a band CPU time grows as the resolution to the power of {growth:.2f} "
        "(about 2 is asked)."
    )
    ratios = [run["estimate"]["memory_mb"] / run["peak_memory_mb"] for run in measured["runs"]]
    within = all(0.6 <= ratio <= 1.4 for ratio in ratios)
    yield (
        f"{word(within)}: memory said before the run is {min(ratios):.2f} to {max(ratios):.2f} of what it took "
        "(within 40 % is asked)."
    )


def _run(measured, *key):
    names = "points", "resolution", "band", "surface"
    return next(run for run in measured["runs"] if tuple(run[name] for name in names) == key)


def _exponent(low, high, axis, value):
    return float(np.log(high[value] / low[value]) / np.log(high[axis] / low[axis]))


def _runs(measured):
    heads = [
        "points",
        "grid",
        "band",
        "surface",
        "seconds",
        "CPU s",
        "of that the field",
        "CPU / Open3D's",
        "peak, MiB",
        "nodes held",
        "faces",
    ]
    peers = {run["points"]: run["cpu"] for run in measured["open3d"]}
    lines = [heads, ["---:", "---:", "---:", "---", *["---:"] * 7]]
    for run in measured["runs"]:
        band = "none" if run["band"] is None else f"{run['band']:g}"
        numbers = (f"{run[key]:.1f}" for key in ("seconds", "cpu", "field_cpu"))
        share = f"{run['nodes']:,} ({run['nodes'] / run['box']:.1%})"
        ratio, peak = f"{run['cpu'] / peers[run['points']]:.2f}", f"{run['peak_memory_mb']:,.0f}"
        what = f"{run['points']:,}", f"{run['resolution']}^3", band, run["surface"]
        lines.append([*what, *numbers, ratio, peak, share, f"{run['faces']:,}"])
    return markdown_rows(lines)


def _open3d(measured):
    parts = [
        f"{run['cpu']:.1f} s ({run['seconds']:.1f} by the clock, {run['peak_memory_mb']:,.0f} MiB) on "
        f"{run['points']:,} points"
        for run in measured["open3d"]
    ]
    return f"Open3D's CPU time: {'; '.join(parts)}."


if __name__ == "__main__":
    sys.exit(main())
