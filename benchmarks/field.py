"""docs/field.md: `python -m benchmarks.field FOLDER` measures the distance field and writes the page."""

import os
import sys
from pathlib import Path

import numpy as np

from core import reconstruct
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report

from . import field_tables as tables
from .cases import SAMPLINGS, find_cases, has_sampling, load_case
from .field_cost import costs
from .field_diffusion import agreement
from .field_lines import cut_nodes, lines
from .field_offsets import offsets
from .field_plots import plot_densities, plot_density_cuts, plot_lines, plot_offsets
from .field_quality import FIELD, SLICED, case_fields, densities, density_slices
from .field_rims import rims
from .field_verdicts import verdicts
from .peers import check_open3d
from .status import DOCS, page_command, said
from .versions import listed, versions

CLOSED, OPEN, BAND = "spot_10k", "cloth_10k", "moebius_5k"
UP = {CLOSED: 1, OPEN: 2}  # the axis drawn upwards
_LIBRARIES = "numpy", "scipy", "libigl", "open3d"

_PAGE = """\
# The distance field

Made by `python -m benchmarks.field FOLDER`, which writes this page, its plots and the numbers behind it
([numbers.json](field/numbers.json)); do not edit it by hand. {versions}.

Resolution 128 and defaults unless said, the whole box; shapes are scaled to a longest side of 0.8. u is what
`DistanceField.sample` reads from the grid: next to the surface from the nodes' steps to it, elsewhere trilinearly from
their values. d is the exact distance to the true mesh. **Distances are times 1000** unless they are in cells (a cell is
about 7.8). *Box*: 20,000 points uniform in the box. *Near*: as many within 0.05 of the surface.
*Nodes*: the nodes of the grid next to the latter, where u is what the method gave and reading it costs nothing.

## What is met and what is not

{verdicts}

## Beside simpler distances

Mean |u − d|. The first three are read from the grid, all others are evaluated at the query itself. What a grid of
values alone can hold at best is the last column: exact distances at the nodes, interpolated, most of whose error is at
the kink of u on the surface. At the nodes themselves all compare alike.

- *ours*: the default. *Poisson*: the paper's integration (`integration="poisson"`). *grid*: the same with the paper's
  diffusion on the grid (`diffusion="grid"`), a dash where the grid or float64 cannot hold it. Its axes are those of the
  nearest samples wherever they are carried, past rims and sharp edges too, where the direction to the surface differs.
- *no diffusion*: the paper's projection field, the distance to the tangent plane of the nearest sample, our normals.
- *nearest*: the nearest sample. *planes*: the tangent plane of the nearest sample, by PCA over 12 neighbours.
  *blended*: the Gaussian-weighted mean of the 12 nearest planes.
- *Open3D*: exact distance to the mesh that Open3D makes (PCA normals over 30 neighbours, orientation along tangent
  planes, Poisson reconstruction at depth 8).

{quality}

## With and without diffusion, by the number of points

Points of the true surfaces of {closed} and {open}, uniform by area. Where the points are denser than the nodes, ours
is held up by the grid, which the distances read straight off the points are not.

![error at nodes near the surface over the number of points](field/densities.png)

{densities}

The cut of the paper's appendix, through {closed}: iso-lines every 0.02.

![cuts of the field with and without diffusion](field/density_cuts.png)

## Offset surfaces

Level sets 0.02 apart on a closed and an open shape: |d − level| at their vertices, off the walls of the box (the level
set of 0.1 touches them). Level 0 is the double cover.

![iso-lines and level sets of {closed}](field/offsets_closed.png)

![iso-lines and level sets of {open}](field/offsets_open.png)

{offsets}

## Along a line

A hat (open) and a bottle (closed) in closed form, 5,000 points each. The peaks of the error are at the surface, where
a grid cannot hold the kink, and on the medial axis.

![u along a line through a hat and a bottle](field/lines.png)

{lines}

## Past open rims

u / d at 4, 8 and 16 cells past the true rim, up to 60 degrees off the sheet: mean, mean of |u / d − 1| and the 5th to
95th percentile. *nearest* is the mean of the distance to the nearest sample over d: what it exceeds 1 by is the strip
between the outermost samples and the true rim, which no method sees. *rim sampled too* has further samples on the true
rim, as far apart as the others: what is left there is the method's own. It lets a sheet go on for a quarter of the
local spacing past its last samples, which on average is a little past the true rim where that is not sampled itself.

{rims}

### Ways to end a sheet

Mean |u / d − 1| at 4, 8 and 16 cells past the rim and mean |u − d| near the surface (x1000), points as sampled, by the
same axes. *none*: the projection field, which has no borders. *discs*: the nearest of the discs of one local spacing
round the 12 nearest samples. *bracket*: the projection field, held between the distance to the nearest sample and one
local spacing less. *rims*: what is kept, the default; *Poisson*: the same rims with the paper's integration.

{borders}

## Diffusion on the grid

Median angle between the axes Y_f of the grid's screened Poisson equations and of the closed-form kernels, around a
torus with true normals. *sqrt(t)*: in cells. *near*: within two local spacings; *held*: up to 33 sqrt(t) from the
points; *lost*: beyond 40, where the solution has drowned in the rounding of float64. At the paper's t = h², 10,000
points on a box of 128 cells make sqrt(t) little more than half a cell and mostly leave much of the box beyond 33
sqrt(t), where `diffusion="grid"` refuses.

{agreement}

## Time, beside the paper's

Seconds on {closed}, points uniform by area; *normals*: facets and sweeps; *field*: patches, diffusion and integration
in the whole box, by default. *published*: the paper's table, **on other hardware** (Core i9-10900, RTX 4090) and other
shapes, so the ratio says how the methods' costs compare in magnitude and no more. Ours: by the clock / CPU seconds of
all threads, a process of its own for every row, on {cores} cores; other work on the machine shows less in the latter.
The paper's grid is a cube of the resolution given, ours has this many cells along the longest side.

### Normals

{normal_cost}

### Diffusion and integration

{field_cost}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    return page_command(
        arguments,
        "field",
        "Measure the distance field on every case of a folder and write docs/field.md.",
        f"holds the cases, .npz files, with {', '.join((CLOSED, OPEN, BAND))}",
        lambda folder: write_page(*measure(folder), DOCS),
    )


def measure(folder: Path) -> tuple[dict, dict]:
    """The numbers of the page and what its plots need besides, printing what is done as it finishes."""
    check_open3d()
    paths, named = find_cases(folder), find_cases(folder, [CLOSED, OPEN, BAND])
    closed, opened, band = map(load_case, named)
    along, line_pictures = said("lines", lines())
    level_sets = {case.name: said(f"offsets of {case.name}", offsets(case)) for case in (closed, opened)}
    numbers = {
        "versions": versions(_LIBRARIES),
        "lines": along,
        "offsets": [rows for rows, _ in level_sets.values()],
        "rims": said("rims", rims([opened, band])),
        "agreement": said("diffusion on the grid", list(agreement())),
        "densities": [said(f"{row['case']}: {row['points']}", row) for c in (closed, opened) for row in densities(c)],
        "quality": {sampling: found for sampling in SAMPLINGS if (found := list(_qualities(paths, sampling)))},
        "cost": [said(f"{row['points']} points, {row['resolution']} cells", row) for row in costs(named[0])],
    }
    pictures = {"lines": line_pictures, "offsets": {name: picture for name, (_, picture) in level_sets.items()}}
    return numbers, pictures | {"densities": _density_cuts(closed)}


def _qualities(paths, sampling):
    for path in paths:
        if has_sampling(path, sampling):
            yield said(f"{path.stem}, {sampling}", case_fields(path, sampling))


def _density_cuts(case):
    """A cut across the shortest side, at its middle."""
    axis = int(np.ptp(case.truth.vertices, axis=0).argmin())
    place = float(np.median(case.truth.vertices[:, axis]))
    nodes = cut_nodes(reconstruct(case.points, FIELD).field, axis, place)
    return {"nodes": nodes, "axis": axis, "up": UP[case.name], **density_slices(case, nodes.reshape(-1, 3))}


def write_page(numbers: dict, pictures: dict, docs: Path) -> Path:
    """Write field.md, the plots and the numbers into the folder `docs`. Returns the page."""
    folder, page = writable_folder(docs / "field"), docs / "field.md"
    write_report(folder / "numbers.json", numbers)
    write_plots(numbers, pictures, folder)
    text = _PAGE.format(
        versions=listed(numbers["versions"]),
        verdicts="\n".join(f"- {line}" for line in verdicts(numbers)),
        quality="\n\n".join(_quality(sampling, results) for sampling, results in numbers["quality"].items()),
        closed=CLOSED,
        open=OPEN,
        cores=os.cpu_count(),
        densities=tables.densities(numbers["densities"]),
        offsets=tables.offsets(numbers["offsets"]),
        lines=tables.lines(numbers["lines"]),
        rims=tables.rims(numbers["rims"]),
        borders=tables.borders(numbers["rims"]),
        agreement=tables.agreement(numbers["agreement"]),
        normal_cost=tables.normal_cost(numbers["cost"]),
        field_cost=tables.field_cost(numbers["cost"]),
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def write_plots(numbers: dict, pictures: dict, folder: Path) -> None:
    plot_lines(folder / "lines.png", numbers["lines"], pictures["lines"])
    for name, case in (("closed", CLOSED), ("open", OPEN)):
        plot_offsets(folder / f"offsets_{name}.png", pictures["offsets"][case], UP[case])
    cuts = pictures["densities"]
    plot_density_cuts(folder / "density_cuts.png", cuts, cuts["nodes"], cuts["axis"], cuts["up"], SLICED)
    plot_densities(folder / "densities.png", numbers["densities"], tables.DENSITY_WAYS)


def _quality(sampling: str, results: list[dict]) -> str:
    return "\n\n".join(
        f"### {sampling.capitalize()} samples, {title}\n\n{tables.quality(results, where)}"
        for where, title in (("near", "near the surface"), ("nodes", "at nodes near it"), ("box", "in the box"))
    )


if __name__ == "__main__":
    sys.exit(main())
