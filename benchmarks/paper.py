"""docs/paper.md: `python -m benchmarks.paper` sets the paper's tables beside ours, from the runs saved in docs/."""

import argparse
import sys
from pathlib import Path

from core import InputError
from core.io.atomic import atomic_path

from .cases import SAMPLINGS
from .published import CATEGORIES, NON_WATERTIGHT, NORMALS, WATERTIGHT
from .report import ABSENT, read_run
from .status import DOCS, DONE, exit_status
from .tables import markdown_rows

PAGES = {"results": "for development", "bench": "made by script"}

# Published shape -> our cases that bear the same name, or where there is none, of the same kind (marked so).
_LIKE_NAMED = {
    "4-Children": (["spot_10k", "bumps_10k"], False),
    "Bears": (["spot_10k", "bumps_10k"], False),
    "Toilet-Paper": (["toiletpaper_10k"], True),
    "Strawberry": (["strawberry_1k"], True),
    "Fertility (1k)": (["fish_1k"], False),
    "Knot (1k)": (["knot_1k"], True),
    "Bunny (10k)": (["spot_10k", "bumps_10k"], False),
    "4-Children (10k)": (["knot_10k"], False),
    "Bears (10k)": (["box_10k"], False),
    "Buddha (100k)": (["bumps_100k"], False),
    "Armadillo (100k)": ([], False),
    "Paperplane (1k)": (["paperplane_1k"], True),
    "Strawberry (1k)": (["strawberry_1k"], True),
    "Lion (10k)": (["mountain_20k", "relief_20k"], False),
    "Cloth (10k)": (["cloth_10k"], True),
    "Candy (10k)": (["candy_10k"], True),
    "Toilet-Paper (10k)": (["toiletpaper_10k"], True),
}
_CATEGORY = {
    "indoor scenes": lambda found: found["category"] == "indoor scene",
    "clothes": lambda found: found["case"].startswith("cloth_10k"),
    "medial axis": lambda found: found["category"] == "medial axis",
    "non-manifold": lambda found: found["category"] == "non-manifold",
    "open": lambda found: found["category"] == "open",
    "high genus": lambda found: found["category"] == "high genus",
    "sparse": lambda found: found["category"] == "sparse",
}

_PAGE = """\
# The paper's tables beside ours

Made by `python -m benchmarks.paper` from the runs behind {pages}; do not edit it by hand.

**Published** figures are copied from the paper: measured there on other hardware (Core i9-10900, RTX 4090), **on other
shapes**, whose meshes are not public, with definitions that it does not spell out. They are no contest: they tell
whether ours are of the same order on shapes of the same name or kind. Our shapes are either *for
development*, on which defaults were chosen and which are not shipped, or *made by script*
({scripted}), at defaults,
{samplings}; ours are CD (mean of the two one-sided mean distances, not squared) and HD (the larger one-sided maximum),
times 1000 on shapes whose longest side is 0.8, which is also the paper's scale. A name in italics is not the same shape
but one of the same kind.
Run times: [the distance field](field.md). Ablation of the weights: [normals](normals.md#weights).

## Normals

NC, |n·n\\*| averaged over the input points. *best other*: the highest that the paper prints for any method but VAD.

{normals}

## Surfaces: watertight

CD / HD at 128 cells. *best other*: the lowest CD and the lowest HD that the paper prints for any other method, which
need not be one and the same.

{watertight}

## Surfaces: not watertight

{non_watertight}

## Benchmark by category

Published: means over 5 to 23 models each, most of 100k to 200k points, at 512 cells. Ours: means over the cases named,
of {uniform_cases} in all, {fewest} to {most} points, at 128 cells, uniform samples. HD is times 1000 here, as
everywhere else; the paper prints it without that factor.

{categories}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.parse_args(arguments)
    return exit_status(lambda: _write(DOCS))


def _write(docs):
    print(f"wrote {write_page(docs)}")
    return DONE


def write_page(docs: Path) -> Path:
    """Write paper.md from the runs saved below `docs`. Returns the page."""
    runs = saved_runs(docs)
    if not runs:
        raise InputError(f"{docs} holds no results; make them with python -m benchmarks FOLDER --results")
    pages = list(dict.fromkeys(page for page, _ in runs))
    results = {where: {r["case"]: r for r in run["cases"] if "error" not in r} for where, run in runs.items()}
    uniform = {page: list(results.get((page, "uniform"), {}).values()) for page in pages}
    points = [result["points"] for found in uniform.values() for result in found]
    text = _PAGE.format(
        pages=" and ".join(f"[{page}.md]({page}.md)" for page in pages),
        scripted="`python -m benchmarks.make_cases FOLDER`",
        samplings=" and ".join(f"*{sampling}*" for sampling in SAMPLINGS) + " samples",
        uniform_cases=len(points),
        fewest=f"{min(points):,}",
        most=f"{max(points):,}",
        normals=_table(NORMALS, results, max, _nc),
        watertight=_table(WATERTIGHT, results, _least, _errors),
        non_watertight=_table(NON_WATERTIGHT, results, _least, _errors),
        categories=_categories(uniform),
    )
    path = docs / "paper.md"
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def saved_runs(docs: Path) -> dict[tuple[str, str], dict]:
    """Runs saved below `docs`, by page and sampling."""
    places = {
        (page, sampling): docs / page / f"{sampling.replace(' ', '_')}.json" for page in PAGES for sampling in SAMPLINGS
    }
    return {where: read_run(path) for where, path in places.items() if path.exists()}


def _table(published, results, best, measure):
    """One row for each published shape and each of our cases that stands beside it."""
    lines = [["published shape", "best other", "VAD, published", "ours on", *SAMPLINGS], ["---"] * 6]
    others = [figures for method, figures in published.items() if method not in ("shapes", "VAD")]
    for k, shape in enumerate(published["shapes"]):
        printed = [_shown(best([figures[k] for figures in others if figures[k]])), _shown(published["VAD"][k])]
        names, same = _LIKE_NAMED[shape]
        rows = 0
        for page, kind in PAGES.items():
            for name in names:
                found = [results.get((page, sampling), {}).get(name) for sampling in SAMPLINGS]
                if any(found):
                    label = f"{name if same else f'*{name}*'}, {kind}"
                    ours = [measure(result) if result else ABSENT for result in found]
                    lines.append([*([shape, *printed] if not rows else [""] * 3), label, *ours])
                    rows += 1
        if not rows:
            lines.append([shape, *printed, *[ABSENT] * 3])
    return markdown_rows(lines)


def _categories(uniform):
    head = ["category", "CD: published", "best other", "ours", "HD: published", "best other", "ours"]
    head += ["F@.005: published", "best other", "ours", "F@.010: published", "best other", "ours", "our cases"]
    lines = [head, ["---", *["---:"] * 12, "---"]]
    for category, (vad, other) in CATEGORIES.items():
        by_page = {page: [r for r in cases if _CATEGORY[category](r)] for page, cases in uniform.items()}
        found = [result for cases in by_page.values() for result in cases]
        cd, hd, near, far = (_mean(found, key, form) for key, form in _FORMS.items())
        named = [f"{PAGES[page]}: {', '.join(r['case'] for r in cases)}" for page, cases in by_page.items() if cases]
        names = "; ".join(named) or ABSENT
        published = [f"{vad[0]:.3f}", f"{other[0]:.3f}", cd, f"{vad[1]:.1f}", f"{other[1]:.1f}", hd]
        published += [f"{vad[2]:.4f}", f"{other[2]:.4f}", near, f"{vad[3]:.4f}", f"{other[3]:.4f}", far]
        lines.append([category, *published, names])
    return markdown_rows(lines)


_FORMS = {"cd": "{:.3f}", "hd": "{:.1f}", "f005": "{:.4f}", "f010": "{:.4f}"}


def _mean(found, key, form):
    return form.format(sum(result["mesh"][key] for result in found) / len(found)) if found else ABSENT


def _least(figures):
    return tuple(min(column) for column in zip(*figures, strict=True))


def _shown(figure):
    return f"{figure[0]:.3f} / {figure[1]:.1f}" if isinstance(figure, tuple) else f"{figure:.4f}"


def _nc(result):
    return f"{result['normals']['nc']:.4f}"


def _errors(result):
    return f"{result['mesh']['cd']:.3f} / {result['mesh']['hd']:.1f}"


if __name__ == "__main__":
    sys.exit(main())
