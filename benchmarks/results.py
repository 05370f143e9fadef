"""docs/results.md, or a page like it: what is measured, how, and what came out, for both samplings."""

import os
from pathlib import Path

from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report

from .against import alone_section, compared, peer_tables, ways
from .peers import PEERS, SHORT
from .plots import plot_cd
from .repeatability import OURS
from .report import markdown_tables
from .run import PEER_LIMIT, TWICE_UP_TO, missing
from .starts import FINE_FROM, ways_to_start
from .status import DOCS

_THREE_DIGITS = 5e-4

_INTRODUCTION = """\
# Results

Made by `{command}`, which writes this page and the numbers behind it
({files}); do not edit it by hand.
{missing}
Every case is a point cloud without normals sampled from a known mesh, whose longest side is 0.8. Settings are the
defaults, the same for every case; nothing is chosen per shape:
{settings}.
**Lengths are in the scale of the case and times 1000**, unless they are in cells of the grid (a cell is about 0.008).
The machine has {cores} CPU cores; no GPU is used. Other work on it shows in every time, by the clock more than in CPU
time: compare ratios alone, of the latter first, and only within a run.
Version of our code and of what measures it: {code}.

{cases}

{alone}{again}## How it is measured

- **Surface**: 200 000 area-uniform, seeded points on either mesh, exact distance to the triangles of the other
  (libigl). *to truth* (what is too much) and *to mesh* (what is missing): mean / maximum. *CD* is the mean of the two
  means, *HD* the larger maximum, *F@t* the harmonic mean of the shares closer than t (in the scale of the case).
- **Double cover, mesh**: it is to be closed, so every edge should have two faces. Its Euler number should be twice that
  of the true surface, borders and junctions included; no expectation is given where sheets cross and the true mesh
  has no edge there. Sheets closer than about two cells cannot be told apart, so those cases miss it for that reason
  too (petals_10k: neighbouring petals come within 0.3 cell). *least angle*: mean of the triangles' smallest angles;
  *no area*: share of faces below a millionth of the mean area.
- **Single layer**: errors as above; Euler number and border loops beside those of the true mesh (which shows junctions
  as it happens to be modelled). Where sheets meet, edges of three and more faces belong there.
- **Normals**: |n·n\\*| at the input points: mean, 5th percentile, and mean within 0.05 of curves where sheets
  meet or cross.
{field}- **Cost**: share of the time of each stage; peak memory of the process (each case has its own, Python and
  libraries included); time over that of *Poisson* below, by the clock and in CPU time, which feels other work on the
  machine less{delaunay}.
- **Against the peers**: the same points, errors measured alike. *NC* here is that of the surface: mean |n·n\\*| of the
  triangles at those 200 000 points and at their closest points on the other mesh, both ways. *seconds*: by the clock,
  {timing}, and *CPU*: of all threads together, which feels other work on the machine less. *MB*: what the run adds to
  the memory of a process of its own (Poisson's two share one), libraries not included. Parameters
  of the peers come from a stated set and are **the best for each case, chosen with the truth at hand**, which favours
  them: {starts}. Ours are the defaults. A peer that is not done with all of these after {limit:g} s is *too slow*.
  *Clean* are cases without noise, strays, holes or wires. *Finer grid*: ours with twice the cells, on cases of {fine:,}
  points or more, whose points are closer together than the default's cells; the paper, too, takes 256 cells there.
  Scale-space reconstruction is not in CGAL's Python package and so is missing; [the field](field.md) is measured beside
  the distance to the nearest sample and to PCA's tangent planes. Poisson closes open surfaces by design, and needs an
  orientation, which non-orientable and non-manifold shapes do not have: read it as what the common route gives on the
  same points.

{ways}

A dash means that there is nothing to measure.
"""
_FIELD = """\
- **Field**, on 20 000 seeded points each: mean |u − d| over the *box* and within 0.05 of the surface (*near*), d the
  exact distance to the true mesh. *eikonal*: mean | ‖∇u‖ − 1 | over those points of the box where the exact distance,
  differenced over the nodes that the gradient depends on (1.5 cells either way), has a slope within 0.02 of 1; that
  leaves out the surface itself and the medial axis, where no field has slope 1. *angle*: median angle between ∇u and
  the direction from the closest true point, from 1.5 cells to 0.05 away. *u on surface*: mean u there, in cells; a
  trilinear reading of exact values at the nodes would give 0.33. *above*: share of nodes where u exceeds the distance
  to the nearest sample, and by how many cells at most; it never should. *u/d 4, 8, 16*: u over the exact distance at
  so many cells past an open rim: mean (5th to 95th percentile), 1 is perfect, below 1 means that the sheet leaks past
  its end.
- **Integration**: the same errors with the paper's Poisson equation in place of the default.
"""
_DELAUNAY = """; and the time of the normals over that of `scipy.spatial.Delaunay` alone (best of three), the least
  that any Voronoi method must spend"""


def write_results(runs: dict[str, dict], name: str = "results") -> Path:
    """Write the page NAME.md and one JSON file for each run, by sampling, into NAME/. Returns the page."""
    folder, page = writable_folder(DOCS / name), DOCS / f"{name}.md"
    first = next(iter(runs.values()))
    text = _INTRODUCTION.format(
        command=_command(first, name),
        files=", ".join(f"[{sampling}]({name}/{_file(sampling)})" for sampling in runs),
        missing="".join(_missing(runs)),
        settings=", ".join(f"{setting} {value}" for setting, value in first["settings"].items()),
        code=", ".join(sorted({r["code"] for run in runs.values() for r in run["cases"] if "code" in r})),
        cases=_case_table(runs),
        alone="".join(f"{alone_section(run['alone'])}\n" for run in runs.values() if run.get("alone")),
        again=_again(runs),
        field=_FIELD if first["field"] else "",
        delaunay=_DELAUNAY if first["field"] else "",
        timing=_timing(first),
        fine=FINE_FROM,
        limit=PEER_LIMIT,
        starts=ways_to_start(),
        cores=os.cpu_count(),
        ways=ways(),
    )
    for sampling, run in runs.items():
        write_report(folder / _file(sampling), run)
        tables = "\n".join(part(run["cases"], level=3) for part in (peer_tables, markdown_tables))
        text += f"\n## Samples: {sampling}\n\n{_picture(run, folder, sampling)}{tables}"
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def _picture(run, folder, sampling):
    """The link to the plot of the run, which is drawn; empty where there is nothing to compare."""
    if not (found := compared(run["cases"])):
        return ""
    path = folder / _file(sampling).replace(".json", ".png")
    plot_cd(path, found)
    return f"![CD of every way on every case over that of ours]({folder.name}/{path.name})\n\n"


def _command(run, name):
    options = [
        *([] if name == "results" else [f"--page {name}"]),
        *([] if run["field"] else ["--surfaces"]),
        *([f"--repeats {run['repeats']}"] if run["repeats"] > 1 else []),
        *([f"--jobs {run['jobs']}"] if run["jobs"] > 1 else []),
    ]
    return " ".join(["python -m benchmarks FOLDER --results", *options])


def _timing(run):
    much = f", of {run['jobs']} cases at a time on all cores with one thread of OpenMP each" if run["jobs"] > 1 else ""
    if run["repeats"] == 1:
        return f"one run{much}"
    return f"the median of {run['repeats']} runs where one takes less than {SHORT:g} s of CPU time, else one run{much}"


def _missing(runs):
    """Lines that say which cases there was no time for."""
    for sampling, run in runs.items():
        if names := missing(run["cases"]):
            yield (
                f"\n**Incomplete**: {len(names)} of {len(run['cases'])} cases with {sampling} samples are not measured "
                f"yet ({', '.join(names)}). The same command goes on from here.\n"
            )


def _again(runs):
    """What measuring cases twice told; empty where none was."""
    found = [result["again"] for run in runs.values() for result in run["cases"] if "again" in result]
    if not found:
        return ""
    lines = ["| way | measured twice | same to the last digit | to three digits | largest difference |"]
    lines.append("|---|---:|---:|---:|---:|")
    for name in (OURS, *PEERS):
        if known := [differences[name] for differences in found if name in differences]:
            same, close = known.count(0.0), sum(difference < _THREE_DIGITS for difference in known)
            title = "VAD" if name == OURS else PEERS[name].title
            lines.append(f"| {title} | {len(known)} | {same} | {close} | {max(known):.1%} |")
    table = "\n".join(lines)
    return f"""\
## The same again

Cases of at most {TWICE_UP_TO:,} points are measured twice, each time in new processes; below, how many of them came out
with the same figures of quality, and by how much any of these differs at most. Samples are seeded for all.

{table}

"""


def _file(sampling):
    return f"{sampling.replace(' ', '_')}.json"


def _case_table(runs):
    """Kind, number of points in each sampling and licence of every case."""
    by_name = [{result["case"]: result for result in run["cases"] if "error" not in result} for run in runs.values()]
    names = dict.fromkeys(name for results in by_name for name in results)
    lines = [
        f"| case | kind | {' | '.join(f'points, {s}' for s in runs)} | licence of the surface |",
        f"|---|---|{'---:|' * len(runs)}---|",
    ]
    for name in names:
        found = [results.get(name) for results in by_name]
        known = next(result for result in found if result)
        counts = " | ".join(str(result["points"]) if result else "–" for result in found)
        lines.append(f"| {name} | {known['category']} | {counts} | {known['licence']} |")
    return "\n".join(lines)
