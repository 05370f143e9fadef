"""docs/layers.md: `python -m benchmarks.layers FOLDER` measures how the two layers of the double cover lie to each
other, and what it costs that they lie apart."""

import sys
from pathlib import Path
from unittest.mock import patch

import numpy as np

from core import Mesh, Settings, reconstruct
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report
from core.surface.double import double_cover
from core.surface.meshing.centring import centred

from .cases import SAMPLINGS, find_cases, has_sampling, load_case
from .geometry import face_normals, surface_samples
from .metrics import surface_errors
from .peers import check_open3d
from .status import DOCS, page_command
from .versions import listed, versions

PERCENTILES = (1, 25, 50, 75, 99)

_LIBRARIES = "numpy", "scipy", "open3d"
_COUNT = 60_000  # points
_REACH = 0.75  # cells, farther sheets are others
_OPPOSITE = -0.5  # largest cosine between the normals of either layer

_PAGE = """\
# The two layers of the double cover

Made by `python -m benchmarks.layers FOLDER`, which writes this page and the numbers behind it
([numbers.json](layers/numbers.json)); do not edit it by hand. {versions}.

The layers are mostly both sides of the single layer, a hair apart: 3e-4 cells. Elsewhere (sheets cross and points do
not show where, others run side by side, points are sparse or dense) they are extracted at an offset and pulled onto
the surface, and where it bends their triangles are other chords of it. So each is taken to its own side of the
surface, by as much as its faces dip through it, and by what either lacks to clear the other: at vertices, and where the
mesh bends sharply at the middles of edges. A viewer that colours back faces shows layers that cross as speckles, and
programs that ask for meshes that do not cross themselves refuse them.

*Gap*: how far the layer behind lies from points of the other, percentiles in cells; negative where it lies in front.
*Paired*: share of the points that have one within .75 cell; of the others nothing is told. *Crossed*: share of those
where it lies in front: along lines where the surface itself crosses, and where points are too few
to tell thin parts from folds. *Astride*: the same for layers extracted at an offset with each face put astride the
surface, as it is where the median distance of the points is less than two thirds of a cell: then errors of the chords
are most of all there are, and twice as large for layers that lie apart. There, and of the sides of a single layer,
whose faces lie astride as well, the column is empty. CD is times 1000, in the scale of the case.

| case | points | paired | crossed | {percentiles} | crossed, astride | CD | CD astride | ratio |
| --- | --- | ---: | ---: | {rules} | ---: | ---: | ---: | ---: |
{rows}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    return page_command(
        arguments,
        "layers",
        "Measure how the two layers of the double cover lie to each other, and write docs/layers.md.",
        "holds cases",
        lambda folder: write_page(measure(folder), DOCS),
    )


def measure(folder: Path) -> list[dict]:
    """A row for every case and sampling."""
    check_open3d()
    pairs = [(path, sampling) for path in find_cases(folder) for sampling in SAMPLINGS if has_sampling(path, sampling)]
    return [layers_of(*pair) for pair in pairs]


def layers_of(path: Path, sampling: str) -> dict:
    """How the layers of one case lie, and with faces astride the surface."""
    print(path.stem, sampling, flush=True)
    case = load_case(path, sampling)
    apart = _told(case)
    with patch.object(double_cover, "laid_apart", lambda mesh, *_: centred(mesh)):
        astride = _told(case)
    told = {f"{name}_astride": None if apart == astride else astride[name] for name in ("crossed", "cd")}
    return {"case": path.stem, "sampling": sampling, **apart, **told}


def _told(case):
    result = reconstruct(case.points, Settings())
    found = gaps(result.surface, result.field.spacing)
    return {
        "paired": len(found) / _COUNT,
        "crossed": float((found < 0).mean()),
        "gap": np.percentile(found, PERCENTILES).tolist(),
        "cd": surface_errors(result.surface, case.truth)["cd"],
    }


def gaps(mesh: Mesh, cell: float, seed: int = 0) -> np.ndarray:
    """How far the other layer lies behind points of the mesh that are uniform by area, in cells, negative where it lies
    in front; of the points that have one within .75 cell."""
    import open3d

    place, face = surface_samples(mesh, _COUNT, np.random.default_rng(seed))
    normal = face_normals(mesh)
    outward = normal[face]
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(*(open3d.core.Tensor(x) for x in (np.float32(mesh.vertices), np.uint32(mesh.faces))))
    rays = np.concatenate([place + _REACH * cell * outward, -outward], axis=1).astype(np.float32)
    hits = scene.list_intersections(open3d.core.Tensor(rays))
    ray = np.repeat(np.arange(len(place)), np.diff(hits["ray_splits"].numpy()))
    hit, behind = hits["primitive_ids"].numpy(), hits["t_hit"].numpy() / cell - _REACH
    kept = (np.einsum("hi,hi->h", normal[hit], outward[ray]) < _OPPOSITE) & (np.abs(behind) < _REACH)
    nearest_last = np.flatnonzero(kept)[np.argsort(-np.abs(behind[kept]), kind="stable")]
    found = np.full(len(place), np.nan)
    found[ray[nearest_last]] = behind[nearest_last]
    return found[np.isfinite(found)]


def write_page(rows: list[dict], docs: Path) -> Path:
    """Write layers.md and the numbers into the folder `docs`. Returns the page."""
    measured_with = versions(_LIBRARIES)
    write_report(writable_folder(docs / "layers") / "numbers.json", {"versions": measured_with, "rows": rows})
    page = docs / "layers.md"
    text = _PAGE.format(
        versions=listed(measured_with),
        percentiles=" | ".join(f"gap, {p} %" for p in PERCENTILES),
        rules=" | ".join("---:" for _ in PERCENTILES),
        rows="\n".join(map(_row, rows)),
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def _row(row):
    gap = " | ".join(f"{value:.4f}" for value in row["gap"])
    cd, astride = row["cd"], row["cd_astride"]
    crossed, *errors = ("–",) * 3
    if astride is not None:
        crossed, *errors = f"{row['crossed_astride']:.1%}", f"{astride:.3f}", f"{cd / astride:.2f}"
    shares = f"{row['paired']:.1%}", f"{row['crossed']:.2%}"
    return f"| {' | '.join([row['case'], row['sampling'], *shares, gap, crossed, f'{cd:.3f}', *errors])} |"


if __name__ == "__main__":
    sys.exit(main())
