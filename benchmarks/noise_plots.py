"""The plot and the picture of docs/noise.md."""

from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from core import reconstruct
from core.io.atomic import atomic_path

from .cases import Case
from .noise_measure import half_noisy, noisy, strewn
from .pictures import View, caption, draw_points, draw_surface, save, sheet
from .plots import COLOURS, QUIET, STYLE

_WAYS = {
    "ours": "here, no setting touched",
    "alternating": "the paper's alternation",
    "jet": "jet smoothing, advancing front",
    "poisson": "Poisson",
}
_CLOSED = "watertight"
_VIEW, _PIXELS = View(), 380


def plot_noise(path: Path, rows: list[dict], category: str) -> None:
    """Mean distance of the points and CD of the surface over the noise, for one case; Poisson only for a closed one."""
    rows = sorted(rows, key=lambda row: row["percent"])
    noise = [row["percent"] for row in rows]
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
        left.plot(noise, [row["before"] for row in rows], color=QUIET, linestyle="--", label="as they come")
        for (way, label), colour in zip(_WAYS.items(), (COLOURS[2], COLOURS[0], COLOURS[1], COLOURS[3]), strict=True):
            known = [row[way] for row in rows if way in row]
            if len(known) < len(rows) or (way == "poisson" and category != _CLOSED):
                continue
            if "after" in known[0]:
                left.plot(noise, [found["after"] for found in known], color=colour, marker="o", label=label)
            right.plot(noise, [found["cd"] for found in known], color=colour, marker="o", label=label)
        left.set(xlabel="noise, % of the longest side", ylabel="mean distance of the points × 10³")
        right.set(xlabel="noise, % of the longest side", ylabel="CD of the surface × 10³")
        for axes in (left, right):
            axes.set_ylim(bottom=0)
            axes.legend(loc="upper left")
        with atomic_path(path) as temporary:
            figure.savefig(temporary, dpi=100)
        plt.close(figure)


def picture(path: Path, case: Case) -> None:
    """Points and surfaces of a case, whose y points up, with noise and with strays."""
    case = replace(case, points=case.points[:, [0, 2, 1]] * [1, -1, 1])
    shown = [
        ("noise .5 %", noisy(case, 0.5)),
        ("noise 1.5 %", noisy(case, 1.5)),
        ("noise .5 % in one half", half_noisy(case, 0.5)[0]),
        ("20 % strays", strewn(case, 0.2)),
    ]
    figure, panels = sheet(2, len(shown))
    camera = _VIEW.camera(noisy(case, 1.5), _PIXELS)
    for (above, below), (title, points) in zip(panels.T, shown, strict=True):
        draw_points(above, points, camera)
        caption(above, title, f"{len(points):,} points")
        draw_surface(below, reconstruct(points).surface, camera, _VIEW)
    save(figure, path)
