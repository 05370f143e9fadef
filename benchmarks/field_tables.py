"""The tables of docs/field.md, Markdown, from its numbers."""

from .field_cost import PUBLISHED_FIELD, PUBLISHED_NORMALS
from .field_metrics import RIM_STEPS
from .report import ABSENT, Column, markdown_table
from .tables import markdown_rows

WAYS = {
    "ours": "ours",
    "poisson": "Poisson",
    "grid": "grid",
    "projection": "no diffusion",
    "nearest": "nearest",
    "planes": "planes",
    "blended": "blended",
    "open3d": "Open3D",
    "exact": "exact nodes",
}
DENSITY_WAYS = {
    "ours": "ours",
    "poisson": "ours, Poisson",
    "projection": "no diffusion",
    "nearest": "nearest sample",
    "planes": "PCA planes",
}
BORDERS = {"none": "none", "discs": "discs", "bracket": "bracket", "kept": "rims", "poisson": "Poisson"}


def quality(results: list[dict], where: str) -> str:
    """One row a case, `where` being "near", "nodes" or "box"."""
    shown = [way for way in WAYS if way != "exact" or where != "nodes"]
    return markdown_table(results, [Column(WAYS[way], f"{way}.{where}") for way in shown])


def densities(rows: list[dict]) -> str:
    lines = []
    for row in rows:
        found = [row[way] for way in DENSITY_WAYS]
        errors = [" / ".join(f"{one[where]:.2f}" for where in ("nodes", "box")) for one in found]
        lines.append([row["case"], f"{row['points']:,}", *errors])
    return "At nodes near the surface / in the box:\n\n" + _table(["shape", "points", *DENSITY_WAYS.values()], lines)


def offsets(shapes: list[dict]) -> str:
    lines = [
        [
            shape["case"],
            f"{row['level']:g}",
            f"{row['vertices']:,}",
            *(f"{row[key]:.2f}" for key in ("mean", "p99", "max")),
            f"{1e-3 * row['mean'] / shape['cell']:.3f}",
        ]
        for shape in shapes
        for row in shape["levels"]
    ]
    return _table(["shape", "level", "vertices", "mean", "99 %", "largest", "mean, cells"], lines)


def lines(shapes: dict[str, dict]) -> str:
    rows = [
        [name, *(f"{found[where][key]:.2f}" for where in ("line", "plane") for key in ("mean", "max"))]
        for name, found in shapes.items()
    ]
    return _table(["shape", "on the line, mean", "largest", "on the plane y = 0.03, mean", "largest"], rows)


def rims(rows: list[dict]) -> str:
    heads = ["shape", "samples", "points", "sample distance, cells"]
    heads += [text for cells in RIM_STEPS for text in (f"u/d at {cells}", "nearest")]
    lines = []
    for row in rows:
        found, nearest = row["ways"]["kept"], row["ways"]["nearest"]
        line = [row["case"], row["sampling"], f"{row['points']:,}", f"{row['spacing']:.2f}"]
        for cells in map(str, RIM_STEPS):
            line += [_ratio(found[cells]), _number(nearest[cells]["mean"], "{:.2f}")]
        lines.append(line)
    return _table(heads, lines)


def borders(rows: list[dict]) -> str:
    heads = ["shape", "measure", *BORDERS.values()]
    lines = []
    for row in rows:
        if row["sampling"] == "as sampled":
            ways = [row["ways"][way] for way in BORDERS]
            for cells in map(str, RIM_STEPS):
                found = [_number(way[cells]["off"], "{:.3f}") for way in ways]
                lines.append([row["case"], f"past the rim, {cells} cells", *found])
            lines.append([row["case"], "near the surface", *(f"{way['near']:.3f}" for way in ways)])
    return _table(heads, lines)


def agreement(rows: list[dict]) -> str:
    lines = [
        [f"{row['points']:,}", f"{row['cells']:g}", str(row["resolution"])]
        + [_number(row[key], "{:.2f}°") for key in ("near", "held", "lost")]
        for row in rows
    ]
    return _table(["points", "sqrt(t)", "resolution", "near", "held", "lost"], lines)


def normal_cost(rows: list[dict]) -> str:
    """Of every number of points the run with the least CPU time."""
    lines = []
    for points, published in PUBLISHED_NORMALS.items():
        best = min((row["normals"] for row in rows if row["points"] == points), key=lambda clock: clock["cpu"])
        lines.append([f"{points:,}", f"{best['seconds']:.2f} / {best['cpu']:.2f}", *_beside(best, published)])
    return _table(["points", "ours", "published", "published / our CPU time"], lines)


def field_cost(rows: list[dict]) -> str:
    lines = [
        [
            f"{row['points']:,}",
            str(row["resolution"]),
            f"{row['field']['seconds']:.2f} / {row['field']['cpu']:.2f}",
            *_beside(row["field"], PUBLISHED_FIELD[row["resolution"]].get(row["points"])),
            f"{row['peak_memory_mb']:,.0f} MiB",
        ]
        for row in rows
    ]
    return _table(["points", "resolution", "ours", "published", "published / our CPU time", "our peak memory"], lines)


def _beside(clock, published):
    return [ABSENT, ABSENT] if published is None else [f"{published:.2f}", f"{published / clock['cpu']:.1f}"]


def _ratio(found):
    if found["mean"] is None:
        return ABSENT
    return f"{found['mean']:.3f}, {found['off']:.3f} ({found['p05']:.2f}–{found['p95']:.2f})"


def _number(value, form):
    return ABSENT if value is None else form.format(value)


def _table(heads, lines):
    numeric = ["---" if line_is_text else "---:" for line_is_text in _texts(lines)]
    return markdown_rows([heads, numeric, *lines])


def _texts(lines):
    """Whether each column holds words."""
    return [any(cell[:1].isalpha() for cell in column) for column in zip(*lines, strict=True)]
