"""Results as tables: on the terminal while they come in, in Markdown, and against an earlier run."""

import json
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from core import InputError

from .tables import markdown_rows

ABSENT = "–"
_NAME_WIDTH = 20
_TOLERANCE = 0.02


@dataclass(frozen=True)
class Column:
    """title; paths of the values in a result, first the leading one; their format; the value that would be perfect
    (None: neither good nor bad); the relative change of the distance to it that counts as a change."""

    title: str
    paths: str
    form: str = "{:.3f}"
    goal: float | None = 0.0
    tolerance: float = _TOLERANCE

    def values(self, result: dict) -> list:
        return [_value(result, path) for path in self.paths.split()]

    def cell(self, values: list) -> str:
        return ABSENT if values[0] is None else self.form.format(*(ABSENT if v is None else v for v in values))


def _rim(cells):
    return Column(f"u/d {cells}", f"rims.{cells}.mean rims.{cells}.p05 rims.{cells}.p95", "{:.2f} ({:.2f}–{:.2f})", 1.0)


SURFACE = [
    Column("CD", "mesh.cd"),
    Column("HD", "mesh.hd", "{:.1f}"),
    Column("to truth", "mesh.to_truth_mean mesh.to_truth_max", "{:.3f} / {:.1f}", None),
    Column("to mesh", "mesh.to_mesh_mean mesh.to_mesh_max", "{:.3f} / {:.1f}", None),
    Column("F@.005", "mesh.f005", "{:.4f}", 1.0),
    Column("F@.010", "mesh.f010", "{:.4f}", 1.0),
]
TOPOLOGY = [
    Column("pieces", "mesh.components", "{}", None),
    Column("Euler (expected)", "mesh.euler mesh.euler_expected", "{} ({})", None),
    Column("off by", "mesh.euler_error", "{}"),
    Column("border edges", "mesh.border_edges", "{}"),
    Column("edges of 3+ faces", "mesh.nonmanifold_edges", "{}"),
    Column("least angle", "mesh.min_angle", "{:.1f}°", 60.0),
    Column("no area", "mesh.zero_area", "{:.3%}"),
]
SHEET = [
    Column("CD", "sheet.cd"),
    Column("HD", "sheet.hd", "{:.1f}"),
    Column("to truth", "sheet.to_truth_mean sheet.to_truth_max", "{:.3f} / {:.1f}", None),
    Column("to mesh", "sheet.to_mesh_mean sheet.to_mesh_max", "{:.3f} / {:.1f}", None),
    Column("F@.005", "sheet.f005", "{:.4f}", 1.0),
    Column("pieces", "sheet.components", "{}", None),
    Column("Euler (true)", "sheet.euler sheet.euler_expected", "{} ({})", None),
    Column("border loops (true)", "sheet.loops sheet.loops_expected", "{} ({})", None),
    Column("edges of 3+ faces", "sheet.nonmanifold_edges", "{}", None),
]
NORMALS = [
    Column("NC", "normals.nc", "{:.4f}", 1.0),
    Column("NC 5 %", "normals.nc_p05", "{:.4f}", 1.0),
    Column("NC junction", "normals.nc_curve", "{:.4f}", 1.0),
]
FIELD = [
    Column("box", "field.box"),
    Column("near", "field.near"),
    Column("eikonal", "field.eikonal", "{:.4f}"),
    Column("angle", "field.angle", "{:.2f}°"),
    Column("u on surface", "field.on_surface", "{:.2f}"),
    Column("above", "field.above_share field.above_max", "{:.2%}, {:.2f}"),
    *(_rim(cells) for cells in (4, 8, 16)),
]
INTEGRATION = [
    Column("box: transport", "field.box", goal=None),
    Column("Poisson", "poisson.box", goal=None),
    Column("near: transport", "field.near", goal=None),
    Column("Poisson", "poisson.near", goal=None),
    Column("eikonal: transport", "field.eikonal", "{:.4f}", None),
    Column("Poisson", "poisson.eikonal", "{:.4f}", None),
]
COST = [
    Column("points", "share.points", "{:.0%}", None),
    Column("cleaning", "share.cleaning", "{:.0%}", None),
    Column("normals", "share.normals", "{:.0%}", None),
    Column("field", "share.field", "{:.0%}", None),
    Column("surface", "share.surface", "{:.0%}", None),
    Column("peak MB", "peak_memory_mb", "{:.0f}", tolerance=0.05),
    Column("total / Poisson", "ratio.total_to_poisson", "{:.2f}", None),
    Column("same, CPU time", "ratio.cpu_to_poisson", "{:.2f}", tolerance=0.3),
    Column("normals / Delaunay", "ratio.normals_to_delaunay", "{:.1f}", None),
]
TABLES = {
    "Double cover": SURFACE,
    "Double cover, mesh": TOPOLOGY,
    "Single layer": SHEET,
    "Normals": NORMALS,
    "Field": FIELD,
    "Integration": INTEGRATION,
    "Cost": COST,
}
_TERMINAL = [
    Column("CD", "mesh.cd"),
    Column("HD", "mesh.hd", "{:.1f}"),
    Column("F.005", "mesh.f005"),
    Column("NC", "normals.nc", "{:.4f}"),
    Column("pieces", "mesh.components", "{}"),
    Column("Euler/exp", "mesh.euler mesh.euler_expected", "{}/{}"),
    Column("box", "field.box"),
    Column("near", "field.near"),
    Column("eikonal", "field.eikonal", "{:.4f}"),
    Column("angle", "field.angle", "{:.2f}"),
    Column("u/d 8", "rims.8.mean", "{:.2f}"),
    Column("seconds", "seconds.total", "{:.1f}"),
    Column("MB", "peak_memory_mb", "{:.0f}"),
    Column("best peer", "best_peer.cd"),
    Column("t/peer", "ratio.total_to_poisson", "{:.2f}"),
]


def terminal_header() -> str:
    return "case".ljust(_NAME_WIDTH) + "".join(c.title.rjust(_width(c)) for c in _TERMINAL)


def terminal_row(result: dict) -> str:
    name = result["case"].ljust(_NAME_WIDTH)
    if "error" in result:
        return f"{name} {result['error']}"
    return name + "".join(c.cell(c.values(result)).rjust(_width(c)) for c in _TERMINAL)


def _width(column):
    return max(9, len(column.title) + 2)


def markdown_tables(results: list[dict], level: int = 2) -> str:
    """Every table of TABLES whose first column has a value, under headings of the level, with what it adds up to."""
    parts = []
    for title, columns in TABLES.items():
        if any(columns[0].values(result)[0] is not None for result in results):
            parts += [f"{'#' * level} {title}", markdown_table(results, columns)]
            parts += [_NOTES[title](results)] if title in _NOTES else []
    return "\n\n".join(parts) + "\n"


def _right_covers(results):
    meshes = [result["mesh"] for result in results if "mesh" in result]
    asked = [mesh["euler_error"] for mesh in meshes if mesh["euler_error"] is not None]
    closed = sum(mesh["border_edges"] == mesh["nonmanifold_edges"] == 0 for mesh in meshes)
    return (
        f"Two faces at every edge on {closed} of {len(meshes)} cases; the Euler number as expected on {asked.count(0)} "
        f"of the {len(asked)} that have one."
    )


def _right_sheets(results):
    sheets = [result["sheet"] for result in results if "sheet" in result]
    euler, loops = (sum(sheet[key] == sheet[f"{key}_expected"] for sheet in sheets) for key in ("euler", "loops"))
    return (
        f"The Euler number of the true mesh on {euler}, its number of border loops on {loops} of {len(sheets)} cases."
    )


_NOTES = {"Double cover, mesh": _right_covers, "Single layer": _right_sheets}


def markdown_table(results: list[dict], columns: list[Column]) -> str:
    """One row a case, and the medians."""
    rows = [["case", *(c.title for c in columns)], ["---", *("---:" for _ in columns)]]
    for result in results:
        if "error" in result:
            rows.append([result["case"], result["error"], *("" for _ in columns[1:])])
        else:
            rows.append([result["case"], *(c.cell(c.values(result)) for c in columns)])
    rows.append(["*median*", *(_median_cell(c, results) for c in columns)])
    return markdown_rows(rows)


def _median_cell(column, results):
    if column.form.startswith("{}") and column.goal is None:
        return ABSENT
    columns = zip(*(column.values(result) for result in results), strict=True)
    medians = [statistics.median_low(known) if (known := [v for v in vs if v is not None]) else None for vs in columns]
    return column.cell(medians)


def read_run(path: Path) -> dict:
    """A run saved earlier. Raises :class:`InputError` where the file is none."""
    try:
        run = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a saved run ({error}); make one with --save") from error
    if not isinstance(run, dict) or "cases" not in run:
        raise InputError(f"{path} is no saved run; make one with --save")
    return run


def comparison(before: dict, after: dict) -> Iterator[str]:
    """Lines that say what became better and what worse from one run to the other, on the cases they share."""
    for key in ("sampling", "settings"):
        if before[key] != after[key]:
            yield f"the runs differ in {key}: {before[key]} -> {after[key]}"
    earlier = {result["case"]: result for result in before["cases"]}
    verdicts = []
    for result in after["cases"]:
        old = earlier.get(result["case"])
        if old is None:
            yield f"{result['case']}: not in the earlier run"
        elif "error" in result or "error" in old:
            yield f"{result['case']}: {old.get('error', 'ran')} -> {result.get('error', 'ran')}"
        else:
            for table, columns in TABLES.items():
                for column in columns:
                    verdict, line = _change(column, old, result)
                    if verdict:
                        verdicts.append(verdict)
                        yield f"{result['case']:{_NAME_WIDTH}}{table + ' ' + column.title:28}{line}"
    yield f"{verdicts.count('better')} better, {verdicts.count('worse')} worse"


def _change(column, old, new):
    """'better', 'worse' or None, and the line that shows it."""
    was, now = column.values(old), column.values(new)
    if column.goal is None or was[0] is None or now[0] is None:
        return None, ""
    before, after = abs(was[0] - column.goal), abs(now[0] - column.goal)
    texts = column.cell(was[:1] * len(was)), column.cell(now[:1] * len(now))
    if texts[0] == texts[1] or abs(after - before) <= column.tolerance * max(before, after):
        return None, ""
    verdict = "better" if after < before else "worse"
    change = f" ({after / before - 1:+.0%} to go)" if before else ""
    return verdict, f"{column.cell(was)} -> {column.cell(now)}  {verdict}{change}"


def _value(result, path):
    first, *rest = path.split(".")
    if first == "share" and "seconds" in result:
        stages = {stage: spent for stage, spent in result["seconds"].items() if stage not in ("total", "cpu")}
        return stages[rest[0]] / sum(stages.values())
    for key in (first, *rest):
        result = result.get(key) if isinstance(result, dict) else None
    return result
