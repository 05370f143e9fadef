"""docs/layers.md: `python -m benchmarks.layers FOLDER` measures how the two layers of the double cover lie to each
other, and what it would cost to lay them apart."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from core import Mesh, Settings, reconstruct
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report
from core.surface.evening import vertex_normals

from .cases import SAMPLINGS, find_cases, has_sampling, load_case
from .geometry import face_normals, surface_samples
from .metrics import surface_errors
from .peers import check_open3d
from .status import page_command

DOCS = Path(__file__).resolve().parent.parent / "docs"
PERCENTILES = (1, 25, 50, 75, 99)

_COUNT = 60_000  # points
_REACH = 0.75  # cells, farther sheets are others
_OPPOSITE = -0.5  # largest cosine between the normals of either layer
_HAIR = 5e-4  # cells, that layers are laid apart

_PAGE = """\
# The two layers of the double cover

Made by `python -m benchmarks.layers FOLDER`, which writes this page and the numbers behind it
([numbers.json](layers/numbers.json)); do not edit it by hand.

Both layers are pulled onto the surface, so they lie on each other, and **they pass through each other**: where the
surface bends, the faces of either are other chords of it. A viewer that colours back faces shows that as speckles, and
programs that ask for meshes that do not cross themselves refuse the double cover; give them the single layer, in
Blender with a Solidify modifier where it is to be solid.

*Gap*: how far the layer behind lies from points of the other, percentiles in cells; negative where it lies in front.
*Crossed*: share of the points where it does. *Apart*: the same mesh with each vertex moved outwards along its normal by
what vertices and middles of edges there need to clear the other layer. It would cost what the last columns say: CD
times 1000, in the scale of the case. Both layers would have to lie outside of the chords that they share now, so the
error of the chords is twice as large; on points denser than the cells that error is all there is.

| case | points | crossed | {percentiles} | crossed, apart | CD | CD apart | ratio |
| --- | --- | ---: | {rules} | ---: | ---: | ---: | ---: |
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
    """How the layers of one case lie, as they are and laid apart."""
    print(path.stem, sampling, flush=True)
    case = load_case(path, sampling)
    result = reconstruct(case.points, Settings())
    cell, mesh = result.field.spacing, result.surface
    apart, found = laid_apart(mesh, cell), gaps(mesh, cell)
    return {
        "case": path.stem,
        "sampling": sampling,
        "crossed": float((found < 0).mean()),
        "gap": np.percentile(found, PERCENTILES).tolist(),
        "crossed_apart": float((gaps(apart, cell) < 0).mean()),
        "cd": surface_errors(mesh, case.truth)["cd"],
        "cd_apart": surface_errors(apart, case.truth)["cd"],
    }


def gaps(mesh: Mesh, cell: float, seed: int = 0) -> np.ndarray:
    """How far the other layer lies behind points of the mesh that are uniform by area, in cells, negative where it lies
    in front; of the points that have one within .75 cell."""
    place, face = surface_samples(mesh, _COUNT, np.random.default_rng(seed))
    found, _ = _behind(mesh, place, face_normals(mesh)[face], cell)
    return found[np.isfinite(found)]


def laid_apart(mesh: Mesh, cell: float) -> Mesh:
    """The mesh with vertices moved outwards, once, by what vertices and middles of edges there need to clear the other
    layer: half on either."""
    (low, high), vertices = mesh.edge_counts()[0].T, mesh.vertices
    normal, _ = vertex_normals(vertices, mesh.faces)
    place = np.concatenate([vertices, 0.5 * (vertices[low] + vertices[high])])
    outward = np.concatenate([normal, normal[low] + normal[high]])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), np.finfo(float).tiny)
    found, face = _behind(mesh, place, outward, cell)
    need = np.where(np.isfinite(found), np.maximum(_HAIR - found, 0.0) / 2, 0.0)
    step, crossed = np.zeros(len(vertices)), need > 0
    np.maximum.at(step, np.arange(len(vertices)), need[: len(vertices)])
    for end in (low, high):
        np.maximum.at(step, end, need[len(vertices) :])
    for corner in mesh.faces[face[crossed]].T:
        np.maximum.at(step, corner, need[crossed])
    return replace(mesh, vertices=vertices + cell * step[:, None] * normal)


def _behind(mesh, place, outward, cell):
    """Along the lines through places (m,3), the nearest faces of the other layer: how far behind they lie in cells,
    (m,) float64, nan where there is none within reach, and which they are, (m,)."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(*(open3d.core.Tensor(x) for x in (np.float32(mesh.vertices), np.uint32(mesh.faces))))
    rays = np.concatenate([place + _REACH * cell * outward, -outward], axis=1).astype(np.float32)
    hits = scene.list_intersections(open3d.core.Tensor(rays))
    ray = np.repeat(np.arange(len(place)), np.diff(hits["ray_splits"].numpy()))
    face, behind = hits["primitive_ids"].numpy().astype(np.int64), hits["t_hit"].numpy() / cell - _REACH
    other = np.einsum("hi,hi->h", face_normals(mesh)[face], outward[ray]) < _OPPOSITE
    kept = np.flatnonzero(other & (np.abs(behind) < _REACH))
    kept = kept[np.argsort(-np.abs(behind[kept]), kind="stable")]  # the nearest last
    distance, nearest = np.full(len(place), np.nan), np.full(len(place), -1)
    distance[ray[kept]], nearest[ray[kept]] = behind[kept], face[kept]
    return distance, nearest


def write_page(rows: list[dict], docs: Path) -> Path:
    """Write layers.md and the numbers into the folder `docs`. Returns the page."""
    write_report(writable_folder(docs / "layers") / "numbers.json", {"rows": rows})
    page = docs / "layers.md"
    text = _PAGE.format(
        percentiles=" | ".join(f"gap, {p} %" for p in PERCENTILES),
        rules=" | ".join("---:" for _ in PERCENTILES),
        rows="\n".join(map(_row, rows)),
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def _row(row):
    gap = " | ".join(f"{value:.4f}" for value in row["gap"])
    return (
        f"| {row['case']} | {row['sampling']} | {row['crossed']:.1%} | {gap} | {row['crossed_apart']:.2%} | "
        f"{row['cd']:.3f} | {row['cd_apart']:.3f} | {row['cd_apart'] / row['cd']:.2f} |"
    )


if __name__ == "__main__":
    sys.exit(main())
