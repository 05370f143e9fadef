"""What docs/noise.md says is met and what is not, from its numbers."""

from collections.abc import Iterator

import numpy as np

from . import noise_cost
from . import noise_tables as tables
from .noise_measure import HALF_NOISE, SHAPE
from .noise_silence import POINTS as SILENCE_POINTS
from .status import word

TARGET_STRAYS, TARGET_SILENCE = 1.2, 1.0
FOUND = 0.9  # of the points of a noisy part, that are moved at least
TARGETS = {0.5: {"factor": 3.3, "nc": 0.985, "cd": 0.90}, 1.0: {"nc": 0.97, "cd": 1.7}}  # for SHAPE, noise in per cent


def verdicts(measured: dict) -> Iterator[str]:
    """A line for each target: what is asked, what came out."""
    for row in measured["noise"]:
        if row["case"] == SHAPE and row["percent"] in TARGETS:
            yield from _of_targets(row, TARGETS[row["percent"]])
    yield from _beside_others(measured["noise"])
    yield from _of_parts(measured["halves"], measured["faint"])
    yield _of_strays(measured["strays"])
    yield _of_bad_input(measured["hostile"], measured["fuzz"])
    yield from _of_stopping(measured["silences"], measured["stops"])
    yield from _of_costs(measured["costs"])
    lost = max(run["lost"] for row in measured["wires"] for run in row["runs"] if not run["share"])
    yield f"{word(not lost)}: of wires without strays {lost:.1%} of the points are dropped at most (none is asked)."


def _of_targets(row, asked):
    where, ours = f"{SHAPE} at {row['percent']:g} %", row["ours"]
    if "factor" in asked:
        reached, least = row["before"] / ours["after"], asked["factor"]
        said = f"distance of the points reduced {reached:.1f} times (at least {least:g} is asked)"
        yield f"{word(reached >= least)}: {where}: {said}."
    least, most = asked["nc"], asked["cd"]
    yield f"{word(ours['nc'] >= least)}: {where}: NC {ours['nc']:.3f} (at least {least:g} is asked)."
    yield f"{word(ours['cd'] <= most)}: {where}: CD {ours['cd']:.3f} (at most {most:g} is asked)."


def _beside_others(rows):
    behind = [tables.place(row) for row in rows if row["ours"]["nc"] < row["pca"]["nc"]]
    yield f"NC is below that of the best PCA on {len(behind)} of {len(rows)} rows: {tables.listed(behind)}."
    behind = [tables.place(row) for row in rows if row["ours"]["after"] > row["alternating"]["after"]]
    yield f"The paper's alternation leaves the points closer to the surface on {', '.join(behind) or 'no row'}."


def _of_parts(halves, faint):
    lost = [row["case"] for row in halves if row["found"] < FOUND]
    yield f"{word(not lost)}: noise of {HALF_NOISE:g} % in one half is found; not on: {tables.listed(lost)}."
    missed = [row for row in faint if row["moved"] < FOUND]
    lost = [f"{row['case']}, {row['part']} of {row['share']:.0%} at {row['level']:g} spacings" for row in missed]
    yield f"Of faint noise and that of small parts {len(lost)} of {len(faint)} are missed: {tables.listed(lost)}."


def _of_strays(rows):
    clean = {row["case"]: row["cd"] for row in rows if not row["share"]}
    ratio = {row["case"]: row["cd"] / clean[row["case"]] for row in rows if row["share"] == 0.05}
    worst = max(ratio, key=ratio.get)
    return (
        f"{word(ratio[worst] <= TARGET_STRAYS)}: with 5 % of strays the CD is at most {ratio[worst]:.2f} times that "
        f"of the clean run, on {worst} (at most {TARGET_STRAYS:g} is asked)."
    )


def _of_bad_input(hostile, fuzz):
    bad = sum(row["outcome"] not in ("done", "refused") for row in hostile)
    bad += fuzz["runs"] - fuzz["done"] - fuzz["refused"]
    return (
        f"{word(not bad)}: of {len(hostile)} bad inputs and {fuzz['runs']} combinations, {bad} crashed, hung or gave "
        "NaN (none is asked)."
    )


def _of_stopping(silences, stops):
    cpu, stage, name = max(
        (found["cpu"], stage, name) for name, stages in silences.items() for stage, found in stages.items()
    )
    yield (
        f"The longest work between two looks at {SILENCE_POINTS:,} points is {cpu:.2f} CPU seconds, in the stage "
        f"{stage} of {name}."
    )
    late, name = max((row["stopped"], name) for name, rows in stops.items() for row in rows)
    yield (
        f"{word(late <= TARGET_SILENCE)}: a cancelled run of {SILENCE_POINTS:,} points is back after {late:.2f} s "
        f"by the clock at most, {name} (at most {TARGET_SILENCE:g} s is asked)."
    )


def _of_costs(rows):
    for key, found in noise_cost.ratios(rows).items():
        yield (
            f"{word(np.abs(found - 1).max() <= noise_cost.WITHIN)}: the {'time' if key == 'cpu' else 'memory'} said "
            f"before a run is {found.min():.2f} to {found.max():.2f} of what it takes, over {len(found)} runs (within "
            f"{noise_cost.WITHIN:.0%} is asked)."
        )
