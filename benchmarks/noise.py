"""docs/noise.md: `python -m benchmarks.noise FOLDER` measures noise, strays and bad input and writes the page."""

import argparse
import os
import sys
import time
from pathlib import Path

from core.cleaning.positions import LONGEST_MOVE
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report

from . import noise_cost, noise_uneven, noise_wires, published
from . import noise_tables as tables
from .alternation import MAX_ROUNDS, SETTLED
from .cases import SAMPLINGS, SPOILED, Case, find_cases, has_sampling, load_case
from .noise_hostile import RESOLUTION, fuzzed, tried
from .noise_measure import (
    CASES,
    FAINT,
    HALF_NOISE,
    MORE,
    NOISE,
    NOISE_OF_MORE,
    PCA_NEIGHBOURS,
    SHAPE,
    SHIFTS,
    SLIGHT,
    STRAYS,
    WALLS,
    measure_between,
    measure_faint,
    measure_half,
    measure_more,
    measure_noise,
    measure_shifted,
    measure_slight,
    measure_strays,
    measure_walls,
    share_noisy,
)
from .noise_plots import picture, plot_noise
from .noise_silence import NOISE as SILENCE_NOISE
from .noise_silence import POINTS as SILENCE_POINTS
from .noise_silence import RUNS, STOPS, silences, sphere, stops
from .noise_verdicts import verdicts
from .peers import check_open3d
from .starts import JET_NEIGHBOURS
from .status import DOCS, DONE, exit_status, said
from .versions import listed, versions

_LIBRARIES = "numpy", "scipy", "open3d", "cgal"

_PAGE = """\
# Noise, strays, bad input

Made by `python -m benchmarks.noise FOLDER`, which writes this page, its pictures and the numbers behind it
([numbers.json](noise/numbers.json)); do not edit it by hand. {versions}.
Every row is one run with default settings unless said otherwise, nothing is chosen per shape or per row. Distances ×
10³, the longest side of a true shape is 0.8.

## What is met and what is not

{verdicts}

## Noise

![points and surfaces with noise and strays](noise/surfaces.png)

Gaussian noise in every coordinate, its standard deviation in per cent of the longest side.

- *here*: `denoise="auto"`. Every sample is projected onto robust quadrics through its neighbours, as many as the data
  ask for, near edges and junctions those of one sheet; none moves further than
  {longest:g} standard deviations of the noise estimated around it.
- *alternation*: the paper's optimisation of positions and normals by turns (`benchmarks.alternation`), with its energy
  for the positions and the reflection sweeps for the normals, until the largest tenth of the changes of the axes
  average below {settled} (at most {rounds} rounds); then the rest of the method, on these positions and normals.
- *jet, front*: CGAL's jet smoothing over {jet} neighbours, then its advancing front.
- *Poisson*: Open3D, PCA normals over 30 neighbours oriented along tangent planes, depth 8. It closes what is open.
- *best PCA*: plane fit to the k nearest of the points as they come, k of {pca} with the highest NC
  on that very row, which nobody can know without the truth.

![distance and CD over noise](noise/noise.png)

The plot shows {shape}.

### Mean distance of the points to the true surface

{distances}

*measured*: the standard deviation of the noise that the run reports, and the true one.

### Normals, mean |n·n\\*|

{normals}

### Surfaces, CD (HD)

{surfaces}

CPU time of a whole run, median over the rows: alternation {alternating_cost:.1f} × here, Poisson {poisson_cost:.2f} ×.

Published CD, **on other shapes** and so no comparison but a scale, beside those here:

{published}

### More points

The same noise on more points of the true surface, so that there are more to average over. CD (HD). *distance*: mean of
the points to the true surface, as they come and as they are moved; *neighbours*: how many the median sample is moved
with. *pieces*: the double cover of a closed surface has two, that of an open one has one.

{more}

### Slight noise

Noise of hundredths of the distance between points, about what rounding coordinates to a tenth of it adds. CD (HD).
Where points are too sparse for some of the shape, noise below a twentieth is taken for detail and left.

{slight}

### Two scans, shifted against each other

Every point is of the one or the other scan, at random, and these are apart by so many local spacings in one direction.
CD (HD) to the surface halfway.

{shifted}

### Thin walls

Every point is of the one or the other sheet, at random, of a wall that is so many local spacings thick all over. There
is no noise. CD (HD) to both sheets.

{walls}

### Noise in one half

Noise of {half_noise:g} % in the half with larger x. *moved*: shares of the noisy and of the clean half that are moved.

{halves}

All {clean_runs} clean samplings of cases in the folder were looked at for noise too; taken for noisy: {taken}.

### Faint noise in a part, noise in a small part

Noise in local spacings in the half with larger x (slab), or in a small part at the top (cap), which may be taken for
detail and left alone. *moved*: share of the noisy points that are. *there alone*: CD with the noisy points moved as
`denoise=1` moves them and no other, by someone who knows which they are.

{faint}

## Strays

Points uniform in the box of the shape, 1.1 times enlarged, added to the clean ones; *strays* is their number over that
of the clean points. *found*: share of them dropped. *lost*: share of the shape's own points dropped with them.
*left in*: the same with `outliers=False`.

{strays}

### Among wires

Points of wires alone with strays uniform in their box, and (last column) in clouds of ten. Each cell: share of the
strays found / share of the wires' points lost, over {wire_runs} runs. Where there are no strays all must stay.

{wires}

What is found stands off every wire nearby by more than the wires' points are apart, and in no line with others as
sparse, which could be a wire sampled less. Strays close to a wire stay, and so do all where there are five or fewer.

## Uneven density, holes, wires

![points of uneven density, wires and holes, and their surfaces](noise/uneven.png)

Tori and a lump by script, no setting touched (pictures too), and with `bridge={bridge:g}`; Poisson as above, which
closes everything. CD (HD).

{uneven}

## Bad input

All of these were fed to a run at resolution {resolution}, the files first to `read_points`. *got* is what the run
returned, with its warnings, or the one line of its refusal.

{hostile}

Beyond these, {fuzz[runs]} combinations of clouds (spheres, grids, planes, close sheets, noise) with duplicates, NaN,
far points, far copies, strays, noise and rounding, as several array types, at scales from 1e-9 to 1e9:
{fuzz[done]} done, {fuzz[refused]} refused in one line, {fuzz[crashed]} crashed, {fuzz[not finite]} with NaN, \
{fuzz[hung]} hung;
the longest took {fuzz[seconds]:.1f} s. The tests draw more of them, and kill runs over existing output at random
moments.

## Cost, said before and taken

What `python -m core info` says of a run and what it took, in a process of its own: processor seconds of all cores,
which other work on the machine hardly changes, and MiB beyond what the libraries take. The seconds by the clock that it
says as well are those, times how busy the machine is at that moment.

{costs}

## Stopping a run

The callback is called in the caller's thread while the work is done in another, so a cancel is heeded though a library
sorts millions of numbers; the work itself ends at its next look. Runs over {silence_points:,} points of a sphere, one
with noise of {silence_noise:g} radii. *waits*: longest time by the clock between two calls of the callback. *looks*:
the work's own, and the longest work between two of them, in processor seconds of all threads.

{silences}

The same runs cancelled at moments spread evenly over them: longest time until the call came back with `Cancelled`, and
until no thread of the run was left, by the clock of a machine that other work {shared}.

{stops}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.noise",
        description="Measure noise, strays and bad input and write docs/noise.md.",
        epilog="exit status: 0 done, 2 bad input (one line says what), 130 cancelled",
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path, help=f"holds the cases, .npz files: {', '.join(CASES)}")
    parser.add_argument("--cases", type=lambda text: text.split(","), default=CASES, help=f"others, {SHAPE} among them")
    parser.add_argument("--docs", type=Path, default=DOCS, help="where to write (default: docs)")
    given = parser.parse_args(arguments)

    def command():
        paths = find_cases(given.folder, given.cases)
        (shape,) = find_cases(given.folder, [SHAPE])
        measured = measure([load_case(path) for path in paths], find_cases(given.folder), shape)
        print(f"wrote {write_page(measured, given.docs)}")
        picture(given.docs / "noise" / "surfaces.png", load_case(shape))
        noise_uneven.picture(given.docs / "noise" / "uneven.png")
        return DONE

    return exit_status(command)


def measure(cases: list[Case], others: list[Path], shape: Path) -> dict:
    """Everything that the page shows, printing what is done as it finishes. `others` are looked at for noise and cost
    alone, `shape` costs with more settings."""
    check_open3d()
    return {
        "versions": versions(_LIBRARIES),
        "hostile": said("bad input", tried()),
        "fuzz": said("fuzz", fuzzed()),
        "clean": dict(said("clean cases", list(_clean(others)))),
        "halves": [said(f"{case.name}, half noisy", measure_half(case, HALF_NOISE)) for case in cases],
        "strays": [said(f"{case.name}, strays {s:.0%}", measure_strays(case, s)) for case in cases for s in STRAYS],
        "wires": [said(f"wires, {name}", noise_wires.measure(name)) for name in noise_wires.WIRES],
        "uneven": [said(name, noise_uneven.measure(name)) for name in noise_uneven.UNEVEN],
        "faint": [said(f"{case.name}, faint noise", measure_faint(case, *how)) for case in cases[:2] for how in FAINT],
        "more": [
            said(f"{case.name}, {count:,} points, {p} %", measure_more(case, count, p))
            for case in cases[:2]
            for p in NOISE_OF_MORE
            for count in MORE
        ],
        "slight": [said(f"{case.name}, slight noise", measure_slight(case, by)) for case in cases for by in SLIGHT],
        "shifted": [said(f"{case.name}, two scans", measure_shifted(case, by)) for case in cases for by in SHIFTS],
        "walls": [said(f"{case.name}, thin walls", measure_walls(case, by)) for case in cases[:2] for by in WALLS],
        "between": [said(f"{case.name}, {p} %", measure_between(case, p)) for case in cases for p in published.NOISE],
        "costs": list(_costs(others, shape)),
        **_stopping(),
        "noise": [said(f"{case.name}, noise {p} %", measure_noise(case, p)) for case in cases for p in NOISE],
        "categories": {case.name: case.meta["category"] for case in cases},
    }


def _clean(paths):
    """Names of clean samplings and the shares of their points that are taken for noisy."""
    for path in paths:
        for sampling in SAMPLINGS:
            if has_sampling(path, sampling):
                case = load_case(path, sampling)
                if case.meta["category"] not in SPOILED:
                    yield f"{case.name}, {sampling}", share_noisy(case)


def _costs(paths, shape):
    """Costs of every sampling and of one case with more settings."""
    for path in paths:
        for sampling, settings in (*noise_cost.EVERY, *(noise_cost.SOME if path == shape else ())):
            if has_sampling(path, sampling):
                yield said(f"cost, {path.stem}, {sampling}", noise_cost.cost(path, sampling, settings))


def _stopping():
    """Silences of each run, and how soon some of them stop."""
    silent, stopped = {}, {}
    for name, (deviation, settings) in RUNS.items():
        points, begun = sphere(deviation), time.perf_counter()
        silent[name] = said(f"silences, {name}", silences(points, settings))
        length = time.perf_counter() - begun
        if name in STOPS:
            stopped[name] = said(f"stops, {name}", stops(points, settings, length, STOPS[name]))
    return {"silences": silent, "stops": stopped, "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None}


def write_page(measured: dict, docs: Path) -> Path:
    """Write noise.md, its plot and its numbers into the folder `docs`. Returns the page."""
    folder, page = writable_folder(docs / "noise"), docs / "noise.md"
    write_report(folder / "numbers.json", measured)
    shape = [row for row in measured["noise"] if row["case"] == SHAPE]
    plot_noise(folder / "noise.png", shape, measured["categories"][SHAPE])
    text = _PAGE.format(
        **{name: tables.markdown(rows) for name, rows in _tables(measured).items()},
        versions=listed(measured["versions"]),
        verdicts="\n".join(f"- {line}" for line in verdicts(measured)),
        longest=LONGEST_MOVE,
        settled=SETTLED,
        rounds=MAX_ROUNDS,
        jet=JET_NEIGHBOURS,
        pca=", ".join(map(str, PCA_NEIGHBOURS)),
        shape=SHAPE,
        alternating_cost=tables.cost(measured["noise"], "alternating"),
        poisson_cost=tables.cost(measured["noise"], "poisson"),
        half_noise=HALF_NOISE,
        clean_runs=len(measured["clean"]),
        taken=tables.listed(f"{share:.1%} of {name}" for name, share in measured["clean"].items() if share),
        wire_runs=noise_wires.RUNS,
        bridge=noise_uneven.BRIDGE,
        shared=f"kept busy (load {measured['load']:.0f})" if measured["load"] else "may have kept busy",
        resolution=RESOLUTION,
        fuzz=measured["fuzz"],
        silence_points=SILENCE_POINTS,
        silence_noise=SILENCE_NOISE,
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def _tables(measured):
    """Rows of the page's tables, by the names that it has for them."""
    return {
        "distances": tables.distances(measured["noise"]),
        "normals": tables.normals(measured["noise"]),
        "surfaces": tables.surfaces(measured["noise"]),
        "halves": tables.halves(measured["halves"]),
        "strays": tables.strays(measured["strays"]),
        "published": tables.beside_published(measured),
        "more": tables.more(measured["more"]),
        "slight": tables.by_level(measured["slight"], "noise"),
        "walls": tables.by_level(measured["walls"], "thickness"),
        "shifted": tables.by_level(measured["shifted"], "shift"),
        "faint": tables.faint(measured["faint"]),
        "wires": tables.wires(measured["wires"]),
        "uneven": tables.uneven(measured["uneven"]),
        "costs": tables.cost_rows(measured["costs"]),
        "stops": tables.stops(measured["stops"]),
        "hostile": tables.hostile(measured["hostile"]),
        "silences": tables.silences(measured["silences"]),
    }


if __name__ == "__main__":
    sys.exit(main())
