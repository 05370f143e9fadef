"""docs/normals.md: `python -m benchmarks.normals FOLDER` measures the axes of stage one and writes the page."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report
from core.normals.energy import EnergyWeights
from core.normals.reflection import TOLERANCE

from .cases import SAMPLINGS, find_cases, has_sampling, load_case
from .normal_cost import costs, exponent
from .normal_quality import (
    ABLATION_STEPS,
    CURVE_STEPS,
    CURVE_SWEEPS,
    PCA_NEIGHBOURS,
    PRINTED,
    ablation,
    case_quality,
    combinations,
    convergence,
)
from .peers import check_open3d
from .plots import plot_convergence, plot_growth
from .report import Column, markdown_table
from .status import DOCS, page_command, said, word
from .tables import markdown_rows
from .versions import listed, versions

SHAPE = "spot_10k"
_LIBRARIES = "numpy", "scipy", "open3d"

TIMED = 10_000, 100_000
TARGET_RATIO, TARGET_GAP, TARGET_TIME, TARGET_MEMORY = 0.5, 1e-3, 3.0, 12.0

_METHODS = {
    "sweeps": "sweeps",
    "pca": "best PCA",
    "open3d": "Open3D",
    "adam": "energy, Adam",
    "printed": "energy as printed",
}
_K = Column("k", "pca.k", "{}", None)
_COMBINATIONS = list(zip(combinations(PRINTED), combinations(EnergyWeights()), strict=True))
_DERIVED = [
    Column("error / best PCA's", "error_ratio", "{:.2f}"),
    Column("truth's facets", "faceting", "{:.2f}", None),
    Column("random start", "start_gap", "{:.5f}"),
    Column("E_d / Adam's", "distance_ratio", "{:.2f}"),
]

_PAGE = """\
# Normals

Made by `python -m benchmarks.normals FOLDER`, which writes this page, its plots and the numbers behind it
([numbers.json](normals/numbers.json)); do not edit it by hand. {versions}.

Stage one alone: the points of each case go in as they are, no cleaning before and nothing chosen per shape, and what
comes out is compared with the true normals. NC is |n·n\\*| at the input points.

- *sweeps*: reflection sweeps, without neighbours on a sheet close beside a sample's own, with axes beside creases taken
  to one of the sheets that meet, the default.
- *best PCA*: plane fit to the k nearest points, with the k of 6 to 24 that has the highest mean NC **on that very
  case**, which nobody can know without the truth.
- *Open3D*: `estimate_normals` over 30 neighbours.
- *energy, Adam*: the paper's energy with a sign-free alignment term and weights
  (λ_a, λ_d, λ_g) = {default}, from a plane fit, to convergence (at most 1000 steps).
- *energy as printed*: the alignment term (1 − n·d)² and the weights {printed} of the paper, from random axes;
  facets are clipped and lengths measured in local spacings as in all of the above, which the paper does not do.

*error / best PCA's* is 1 − NC of the sweeps over that of the best PCA. True normals are those of the true mesh's flat
triangles; *truth's facets* is what these alone cost: 1 − NC of the same mesh's normals interpolated between its
vertices, again over that of the best PCA. Where the mesh stands for a smooth shape, no smooth estimate can be expected
below that; where its edges are meant, the number says nothing. *random start* is how much NC changes when the sweeps
start from random axes, and *E_d / Adam's* the E_d of the paper that the sweeps end with over what Adam reaches.

## What is met and what is not

The aims of this stage, and what came out:

{verdicts}

{quality}## Weights

NC on area-uniform points of {shape} for the paper's seven combinations of weights, with the sign-free alignment term,
from a plane fit, {ablation_steps} steps of Adam each. *printed*: the paper's numbers as they are. Because areas here
are clipped and lengths in local spacings, they weigh the alignment far more than in the paper. *default*: the same
multiples of the default weights {default}. Each head gives both, (λ_a, λ_d, λ_g). The paper's own figures, on
its own shapes, are .9103 to .9617 at 3,000 points and .9735 to .9844 at 10,000.

{ablation}

## Convergence

![energy over Adam's steps, and mean turn over sweeps](normals/convergence.png)

Both from random axes, on points of {shape}: 20,000 (*dense*), the blue-noise sampling of the case (*uniform*),
a density that falls thirtyfold along its longest side (*non-uniform*), 500 (*sparse*), and Gaussian noise of .5 % of
the longest side (*noisy*). Shown are the first {curve_steps} steps and the first {curve_sweeps} sweeps; after twenty of
these the solver holds every axis back a little, which ends what still swings at creases.

{steps}

## Cost

![CPU time over the number of points](normals/growth.png)

Points of {shape} in random order. *stage*: facets and sweeps. *Delaunay*: `scipy.spatial.Delaunay` alone on the same
points in the same process, right after; the best of three up to 100,000 points, a single run beyond. Local spacings,
which the field needs as well, are not counted. Other work on the machine shows least in the ratio of CPU times.
*peak*: resident memory of the whole process, libraries included.

{cost}

From 10,000 points on, CPU time grows as n^{stage_exponent:.2f}; Delaunay alone as n^{delaunay_exponent:.2f}.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    return page_command(
        arguments,
        "normals",
        "Measure the normals of every case of a folder and write docs/normals.md.",
        f"holds the cases, .npz files, {SHAPE} among them",
        lambda folder: write_page(measure(folder), DOCS),
    )


def measure(folder: Path) -> dict:
    """Everything that the page shows, printing what is done as it finishes."""
    check_open3d()
    paths, (shape,) = find_cases(folder), find_cases(folder, [SHAPE])
    return {
        "versions": versions(_LIBRARIES),
        "quality": {sampling: list(_qualities(paths, sampling)) for sampling in SAMPLINGS},
        "ablation": said("ablation", ablation(load_case(shape))),
        "convergence": said("convergence", convergence(load_case(shape, "blue noise"))),
        "cost": [said(f"cost at {run['points']} points", run) for run in costs(shape)],
    }


def _qualities(paths, sampling):
    for path in paths:
        if has_sampling(path, sampling):
            yield said(f"{path.stem}, {sampling}", case_quality(path, sampling))


def write_page(measured: dict, docs: Path) -> Path:
    """Write normals.md, the plots and the numbers into the folder `docs`. Returns the page."""
    folder, page = writable_folder(docs / "normals"), docs / "normals.md"
    write_report(folder / "numbers.json", measured)
    plot_convergence(folder / "convergence.png", measured["convergence"], float(np.degrees(TOLERANCE)))
    plot_growth(folder / "growth.png", measured["cost"])
    text = _PAGE.format(
        versions=listed(measured["versions"]),
        default=_triple(EnergyWeights()),
        printed=_triple(PRINTED),
        verdicts="\n".join(f"- {line}" for line in verdicts(measured)),
        quality="".join(_quality_tables(s, results) for s, results in measured["quality"].items()),
        shape=SHAPE,
        ablation_steps=ABLATION_STEPS,
        ablation=_ablation_table(measured["ablation"]),
        curve_steps=CURVE_STEPS,
        curve_sweeps=CURVE_SWEEPS,
        steps=_steps(measured["convergence"]),
        cost=_cost_table(measured["cost"]),
        stage_exponent=exponent(measured["cost"], "stage_cpu"),
        delaunay_exponent=exponent(measured["cost"], "delaunay_cpu"),
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def verdicts(measured: dict) -> Iterator[str]:
    """A line for each target: what is asked, what came out."""
    for sampling, results in measured["quality"].items():
        clean = [result["error_ratio"] for result in results if result["category"] != "noisy"]
        ratio = float(np.mean(clean))
        yield (
            f"{word(ratio <= TARGET_RATIO)}, {sampling}: 1 − NC of the sweeps over that of the best PCA is "
            f"{ratio:.2f} on average over the {len(clean)} cases without added noise (at most {TARGET_RATIO} is asked)."
        )
        if high := [r for r in results if r["category"] != "noisy" and r["error_ratio"] > TARGET_RATIO]:
            listed = "; ".join(f"{r['case']} {r['error_ratio']:.2f} ({r['faceting']:.2f})" for r in high)
            yield f"{sampling}: above {TARGET_RATIO} are, with what the truth's facets alone cost, {listed}."
        above = _above_pca(results, "pca")
        yield f"{word(not above)}, {sampling}: more error than the best PCA on {above or 'no case'} (none is asked)."
        if closer := _above_pca(results, "closer_pca"):
            yield f"{sampling}: a PCA over fewer than {PCA_NEIGHBOURS[0]} neighbours has less error yet on {closer}."
        gap = max(results, key=lambda result: result["start_gap"])
        yield (
            f"{word(gap['start_gap'] <= TARGET_GAP)}, {sampling}: random axes and the plane fit as the start of the "
            f"sweeps differ by at most {gap['start_gap']:.5f} in NC, on {gap['case']} (at most {TARGET_GAP} is asked)."
        )
        higher = [result["case"] for result in results if result["distance_ratio"] > 1]
        yield (
            f"{word(not higher)}, {sampling}: the sweeps end with a higher E_d than Adam on {len(higher)} of "
            f"{len(results)} cases (none is asked); they minimise a smooth bound of it, not E_d itself."
        )
        better = [result["case"] for result in results if result["adam"]["nc"] > result["sweeps"]["nc"]]
        yield f"{sampling}: the energy with Adam has a higher NC than the sweeps on {', '.join(better) or 'no case'}."
        for result in results:
            if result["cleaned"]:
                yield (
                    f"{sampling}: on {result['case']} the pipeline cleans the points first, which takes the sweeps "
                    f"from NC {result['sweeps']['nc']:.4f} to {result['cleaned']['nc']:.4f}; best PCA on the raw "
                    f"points has {result['pca']['nc']:.4f}."
                )
    for run in measured["cost"]:
        if run["points"] in TIMED:
            ratio = run["stage_cpu"] / run["delaunay_cpu"]
            yield (
                f"{word(ratio <= TARGET_TIME)}: the stage takes {ratio:.2f} × the CPU time of Delaunay alone at "
                f"{run['points']:,} points (at most {TARGET_TIME:g} is asked)."
            )
    largest = measured["cost"][-1]
    peak = largest["peak_memory_mb"] / 2**10
    yield (
        f"{word(peak <= TARGET_MEMORY)}: {largest['points']:,} points peak at {peak:.1f} GiB "
        f"(at most {TARGET_MEMORY:g} is asked)."
    )


def _above_pca(results, method):
    """Cases where the sweeps agree less than a plane fit, with both NC and the fit's k, as text."""
    worse = [result for result in results if result["sweeps"]["nc"] < result[method]["nc"]]
    return "; ".join(
        f"{r['case']} ({r['sweeps']['nc']:.4f}, {r[method]['nc']:.4f} at k = {r[method]['k']})" for r in worse
    )


def _quality_tables(sampling, results):
    at_junctions = [result for result in results if result["sweeps"]["nc_curve"] is not None]
    tables = {
        "NC": (results, [*_columns("nc"), _K, *_DERIVED]),
        "5th percentile": (results, _columns("nc_p05")),
        "NC within 0.05 of curves where sheets meet or cross": (at_junctions, _columns("nc_curve")),
    }
    parts = [f"## Samples: {sampling}\n"]
    for title, (shown, columns) in tables.items():
        if shown:
            parts.append(f"### {title}\n\n{markdown_table(shown, columns)}\n")
    return "\n".join(parts) + "\n"


def _columns(measure):
    return [Column(title, f"{method}.{measure}", "{:.4f}", 1.0) for method, title in _METHODS.items()]


def _ablation_table(rows):
    heads = [f"{_triple(printed)} / {_triple(ours)}" for printed, ours in _COMBINATIONS]
    lines = [["points", "weights", *heads, "sweeps"], ["---:", "---", *("---:" for _ in heads), "---:"]]
    for row in rows:
        for name in ("printed", "default"):
            found = [f"{nc:.4f}" for nc in row[name]]
            lines.append([f"{row['points']:,}", name, *found, f"{row['sweeps']:.4f}"])
    return markdown_rows(lines)


def _steps(curves):
    lines = [
        ["input", "points", "least energy / energy at the start", "turn in the last sweep shown", "sweeps to the end"]
    ]
    lines.append(["---", *("---:" for _ in lines[0][1:])])
    for name, curve in curves.items():
        least, turn = f"{min(curve['energy']):.4f}", f"{curve['turns'][-1]:.3f}°"
        lines.append([name, f"{curve['points']:,}", least, turn, str(curve["sweeps"])])
    return markdown_rows(lines)


def _cost_table(runs):
    lines = [["points", "stage / Delaunay, CPU", "by the clock", "facets' share of the stage", "peak"]]
    lines.append(["---:"] * len(lines[0]))
    for run in runs:
        cpu, clock = run["stage_cpu"] / run["delaunay_cpu"], run["stage_seconds"] / run["delaunay_seconds"]
        share, peak = run["facets_cpu"] / run["stage_cpu"], run["peak_memory_mb"]
        lines.append([f"{run['points']:,}", f"{cpu:.2f}", f"{clock:.2f}", f"{share:.0%}", f"{peak:,.0f} MiB"])
    return markdown_rows(lines)


def _triple(weights):
    return f"({weights.alignment:g}, {weights.distance:g}, {weights.gradient:g})"


if __name__ == "__main__":
    sys.exit(main())
