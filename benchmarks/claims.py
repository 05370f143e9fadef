"""`python -m benchmarks.claims`: what the README says of other ways, from the runs saved in docs/."""

import argparse
import statistics
import sys
from pathlib import Path

from core.io.atomic import atomic_path

from .against import SHARE, WORSE_BY, compared, over_best, unmatched
from .alone import WITHIN
from .cases import SAMPLINGS, SPOILED
from .paper import saved_runs
from .status import DOCS, DONE, exit_status
from .tables import markdown_rows

README = DOCS.parent / "README.md"
START, END = "<!-- results -->\n", "<!-- /results -->"
_COMMANDS = {"results": "python -m benchmarks FOLDER --results", "bench": "make bench-full"}
_TITLES = {"results": "development cases", "bench": "shapes made by script"}


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    argparse.ArgumentParser(prog="python -m benchmarks.claims", description=__doc__).parse_args(arguments)
    return exit_status(lambda: _write(README))


def _write(readme):
    with atomic_path(readme) as temporary:
        temporary.write_text(with_claims(readme.read_text("utf-8"), claims(DOCS)), "utf-8")
    print(f"wrote {readme}")
    return DONE


def with_claims(text: str, found: str) -> str:
    """The README `text` with `found` between its marks."""
    before, rest = text.split(START)
    return f"{before}{START}{found}{END}{rest.split(END)[1]}"


def claims(docs: Path) -> str:
    """A table with a line for each saved run, and what is asked of it."""
    heads = ["", "clean cases", "lowest CD", "at worst", "clock", "CPU", "memory", "made by"]
    lines = [heads, ["---", *["---:"] * 6, "---"]]
    for (page, sampling), run in saved_runs(docs).items():
        clean = [result for result in compared(run["cases"]) if result["category"] not in SPOILED]
        if clean:
            ratios = [over_best(result) for result in clean]
            won = sum(ratio < 1 for ratio in ratios)
            times = [_time(run, key) for key in ("seconds", "cpu")]
            name = f"[{_TITLES[page]}](docs/{page}.md), {sampling}"
            score = [str(len(clean)), f"{won}, {won / len(clean):.0%}", f"{max(ratios):.2f}"]
            lines.append([name, *score, *times, _memory(run), f"`{_COMMANDS[page]}`"])
    return f"""\
Against Open3D's Poisson reconstruction, plain and trimmed, ball pivoting and alpha shapes, and CGAL's advancing front,
each with the best for the case at hand of [a stated set of normals and parameters](docs/bench.md#how-it-is-measured),
VAD at its defaults:

{markdown_rows(lines)}

*Lowest CD*: cases on which the double cover's mean distance to the truth, both ways, is below every other's (aim:
{SHARE:.0%} of them); *at worst*: its CD over that of the best other (aim: {WORSE_BY} at most); *clock*, *CPU*: whole
run over Open3D's normals, orientation and Poisson, the median over cases of about 10,000 points timed with nothing else
of the bench beside them (aim: {WITHIN} at most); *memory*: what a run takes over what Poisson's does, the median.
{_spoiled(docs)}
Defaults were chosen on the development cases, the `FOLDER`, which are not shipped; the others have shown faults that
were mended: none is held out.
"""


def _time(run, key):
    ratios = [found["ratio"][key] for found in run.get("alone", {}).values() if "ratio" in found]
    return f"{statistics.median(ratios):.2f}" if ratios else "–"


def _spoiled(docs):
    """The cases with noise, strays, holes or wires, counted."""
    runs = [run for (page, sampling), run in saved_runs(docs).items() if sampling == next(iter(SAMPLINGS))]
    spoiled = [result for run in runs for result in compared(run["cases"]) if result["category"] in SPOILED]
    won = sum(over_best(result) < 1 for result in spoiled)
    said = f"With noise, strays, holes or wires it has the lowest CD on {won} of {len(spoiled)} cases"
    alone = [name for run in runs for name in unmatched(run["cases"])]
    return f"{said}.\nNo count has {', '.join(alone)}, where no other came to an end." if alone else f"{said}."


def _memory(run):
    found = [(r["memory_mb"], r["peers"]["poisson"]) for r in compared(run["cases"]) if "poisson" in r["peers"]]
    ratios = [ours / poisson["memory_mb"] for ours, poisson in found if poisson.get("memory_mb")]
    return f"{statistics.median(ratios):.1f}" if ratios else "–"


if __name__ == "__main__":
    sys.exit(main())
