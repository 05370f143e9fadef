"""The plots of docs/normals.md and of the pages of results."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.ticker import MaxNLocator

from core.io.atomic import atomic_path

from .against import OURS, best_peer, contenders
from .peers import PEERS

INK, QUIET, ACCENT = "#1b2430", "#66707c", "#e4572e"
COLOURS = ["#17344f", "#3f7fa3", ACCENT, "#c9a227", "#6a8d55"]
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.prop_cycle": plt.cycler(color=COLOURS),
    "grid.color": "#e6e9ec",
    "legend.frameon": False,
}


def plot_convergence(path: Path, curves: dict[str, dict], tolerance: float) -> None:
    """Energy before each step of Adam, and mean turn of an axis in each sweep; see `convergence`.

    tolerance : degrees, mean turn at which the sweeps end
    """
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
        for name, curve in curves.items():
            left.plot(curve["energy"])
            turns = curve["turns"]
            right.plot(range(1, len(turns) + 1), turns, marker=".", label=f"{name}, {curve['points']:,} points")
        left.set(yscale="log", xlabel="step of Adam", ylabel="energy / energy of the random start")
        right.axhline(tolerance, color=QUIET, linestyle="--", linewidth=1)
        right.annotate("the sweeps end here", (1, tolerance), (0, 4), textcoords="offset points", color=QUIET)
        right.xaxis.set_major_locator(MaxNLocator(integer=True))
        right.legend(loc="lower left")
        right.set(yscale="log", xlabel="sweep", ylabel="mean turn of an axis, degrees")
        _save(figure, path)


def plot_growth(path: Path, measured: list[dict]) -> None:
    """CPU time of the stage and of Delaunay alone over the number of points, in units of Delaunay's at the fewest."""
    counts, unit = [run["points"] for run in measured], measured[0]["delaunay_cpu"]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
        for key, label, colour in (
            ("stage_cpu", "facets and sweeps", ACCENT),
            ("delaunay_cpu", "scipy.spatial.Delaunay alone", COLOURS[1]),
        ):
            axes.plot(counts, [run[key] / unit for run in measured], color=colour, marker="o", label=label)
        straight = measured[0]["stage_cpu"] / unit
        axes.plot(
            counts, [straight * n / counts[0] for n in counts], color=QUIET, linestyle="--", linewidth=1, label="linear"
        )
        axes.set(xscale="log", yscale="log", xlabel="points", ylabel=f"CPU time / Delaunay's at {counts[0]:,} points")
        axes.legend()
        _save(figure, path)


def plot_cd(path: Path, results: list[dict]) -> None:
    """CD of every way on every case that can be compared, over that of our double cover, best case for us on top."""
    results = sorted(results, key=lambda result: result["mesh"]["cd"] / result["peers"][best_peer(result)]["cd"])
    found = {result["case"]: {n: m["cd"] for n, m in contenders(result).items() if "cd" in m} for result in results}
    cases = list(found)
    titles = OURS | {name: peer.title for name, peer in PEERS.items()}
    marks = dict(zip(titles, "|dosv^P", strict=True))
    colours = dict(zip(titles, [ACCENT, ACCENT, *COLOURS[:2], *COLOURS[3:], QUIET], strict=True))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(8, 1.4 + 0.2 * len(cases)), layout="constrained")
        for way, title in titles.items():
            rows = [row for row, case in enumerate(cases) if way in found[case]]
            ratios = [found[cases[row]][way] / found[cases[row]]["double"] for row in rows]
            axes.plot(ratios, rows, marks[way], color=colours[way], label=title, markersize=5, alpha=0.9)
        axes.axvline(1, color=ACCENT, linewidth=1)
        axes.set_yticks(range(len(cases)), cases, fontsize=8)
        axes.set(
            xscale="log", xlabel="CD / that of VAD's double cover; left of the line is better", ylim=(len(cases), -1)
        )
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=4, fontsize=8)
        _save(figure, path)


def _save(figure, path):
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=110)
    plt.close(figure)
