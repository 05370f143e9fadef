"""`python -m benchmarks.claims`: what the README says of other ways, from the runs saved in docs/."""

import argparse
import statistics
import sys
from pathlib import Path

from core.io.atomic import atomic_path

from .against import SHARE, WORSE_BY, best_peer, compared, contenders
from .alone import WITHIN
from .cases import SAMPLINGS, SPOILED
from .paper import DOCS, saved_runs
from .status import DONE, exit_status

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
    lines = ["| | clean cases | lowest CD | at worst | clock | CPU | made by |", "|---|---:|---:|---:|---:|---:|---|"]
    for (page, sampling), run in saved_runs(docs).items():
        clean = [result for result in compared(run["cases"]) if result["category"] not in SPOILED]
        if clean:
            ratios = [contenders(result)["double"]["cd"] / result["peers"][best_peer(result)]["cd"] for result in clean]
            won = sum(ratio <= 1 for ratio in ratios)
            times = [_time(run, key) for key in ("seconds", "cpu")]
            name = f"[{_TITLES[page]}](docs/{page}.md), {sampling}"
            score = f"{won}, {won / len(clean):.0%}"
            lines.append(
                f"| {name} | {len(clean)} | {score} | {max(ratios):.2f} | {' | '.join(times)} | `{_COMMANDS[page]}` |"
            )
    table = "\n".join(lines)
    return f"""\
Against Open3D's Poisson reconstruction, plain and trimmed, ball pivoting and alpha shapes, and CGAL's advancing front,
each with the best of its parameters for the case at hand, VAD at its defaults:

{table}

*Lowest CD*: cases on which the double cover's mean distance to the truth, both ways, is below every other's (aim:
{SHARE:.0%} of them); *at worst*: its CD over that of the best other (aim: {WORSE_BY} at most); *clock*, *CPU*: whole
run over Open3D's normals, orientation and Poisson, the median over cases of about 10,000 points timed with nothing
beside them (aim: {WITHIN} at most). {_spoiled(docs)}
"""


def _time(run, key):
    ratios = [found["ratio"][key] for found in run.get("alone", {}).values() if "ratio" in found]
    return f"{statistics.median(ratios):.2f}" if ratios else "–"


def _spoiled(docs):
    """The cases with noise, strays, holes or wires, counted."""
    runs = [run for (page, sampling), run in saved_runs(docs).items() if sampling == next(iter(SAMPLINGS))]
    spoiled = [result for run in runs for result in compared(run["cases"]) if result["category"] in SPOILED]
    won = sum(result["mesh"]["cd"] <= result["peers"][best_peer(result)]["cd"] for result in spoiled)
    return f"With noise, strays, holes or wires it has the lowest CD on {won} of {len(spoiled)} cases."


if __name__ == "__main__":
    sys.exit(main())
