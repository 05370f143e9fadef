"""What docs/field.md says is met and what is not, from its numbers."""

from collections.abc import Iterator

import numpy as np

from .cases import SPOILED
from .field_metrics import RIM_STEPS
from .field_tables import WAYS
from .status import word

BOX, NEAR, RIM = 1.2, 0.45, 0.1
BASELINES = "nearest", "planes", "blended", "open3d"


def verdicts(numbers: dict) -> Iterator[str]:
    """A line for each aim: what is asked, what came out."""
    for sampling, results in numbers["quality"].items():
        clean = [result for result in results if result["category"] not in SPOILED]
        if not clean:
            continue
        for where, most in (("box", BOX), ("near", NEAR)):
            mean = float(np.mean([result["ours"][where] for result in clean]))
            place = "in the box" if where == "box" else "near the surface"
            yield (
                f"{word(mean <= most)}, {sampling}: mean |u − d| {place} is {mean:.2f} on average over the "
                f"{len(clean)} clean cases (at most {most:g} is asked)."
            )
        for way in BASELINES:
            read, nodes = _ahead(clean, way, "near"), _ahead(clean, way, "nodes")
            yield (
                f"{word(not read)}, {sampling}: near the surface, *{WAYS[way]}* is as close as ours or closer on "
                f"{read or 'no clean case'} (none is asked); at the nodes on {nodes or 'none'}."
            )
        for way in ("projection", "poisson"):
            read, nodes = _ahead(clean, way, "near"), _ahead(clean, way, "nodes")
            yield (
                f"{sampling}: near the surface, *{WAYS[way]}* is as close as ours or closer on "
                f"{read or 'no clean case'}; at the nodes on {nodes or 'none'}."
            )
    for row in numbers["rims"]:
        if row["sampling"] == "as sampled":
            found = {cells: row["ways"]["kept"][str(cells)] for cells in RIM_STEPS}
            found = {cells: one for cells, one in found.items() if one["mean"] is not None}
            if not found:
                continue
            worst = max(abs(one["mean"] - 1) for one in found.values())
            steps = ", ".join(map(str, found))
            off = ", ".join(f"{one['off']:.3f}" for one in found.values())
            yield (
                f"{word(worst <= RIM)}: past the rim of {row['case']}, u is within {worst:.1%} of d on average at "
                f"{steps} cells (at most {RIM:.0%} is asked); point by point it is off by {off} of d on average."
            )


def _ahead(results, way, where):
    """The cases where `way` errs no more than ours, with both errors, as text."""
    ahead = [result for result in results if result[way][where] <= result["ours"][where]]
    return "; ".join(f"{r['case']} ({r[way][where]:.2f}, ours {r['ours'][where]:.2f})" for r in ahead)
