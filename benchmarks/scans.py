"""docs/scans.md: `python -m benchmarks.scans` reconstructs what scanners make of known shapes, and writes the page."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from core import Settings, reconstruct
from core.io.atomic import atomic_path, writable_folder
from core.io.report import write_report

from .catalogue import CASES
from .geometry import closest_points, surface_points
from .noise_measure import by_peer, cd_and_hd, kept_points
from .noise_tables import cells, markdown
from .peers import check_open3d, poisson
from .pictures import View, caption, draw_points, draw_surface, save, sheet
from .scanners import IMAGES, JUMP, SHARE, before_camera, depth_frame, depth_images, in_room, seen_from_one_spot
from .shapes import rooms
from .starts import FILTER, without_strays
from .status import DOCS, DONE, exit_status, said
from .versions import listed, versions
from .voxels import occupied, segmented

SHAPES = ("bumps_10k", "box_10k", "tangle_10k", "knot_10k", "candy_10k", "hemisphere_2k", "cloth_10k", "mask_5k")
POINTS = 20_000
FAR = 0.008  # distance from the surface from which on a flying point is far from it, a hundredth of the longest side
ROOM_POINTS = 30_000, 120_000
ROOM_NOISE = 0.0, 0.1, 0.3  # per cent of the longest side
FRAME_WIDTH = 320  # pixels
FRAMES = (1.5, 0.0), (1.5, 0.3), (4.0, 0.0), (4.0, 0.3), (8.0, 0.5)  # pixels to a step of depth; noise, steps
FRAME_SHOWN = FRAMES[3]
VOXELS = [
    (kind, name, across)
    for kind, names in (
        ("occupied", ("bumps_10k", "tangle_10k", "cloth_10k")),
        ("segmented", ("bumps_10k", "tangle_10k")),
    )
    for name in names
    for across in (40, 80)
]

_FEET = 100_000
_PIXELS = 480
_LIBRARIES = "numpy", "scipy", "open3d"

_PAGE = """\
# Scans

Made by `python -m benchmarks.scans`, which takes the scans, writes this page, its picture and the numbers behind it
([numbers.json](scans/numbers.json)); do not edit it by hand. {versions}.
Every row is one run with default settings. Distances × 10³, the longest side of a true shape is 0.8.

![Points and surfaces of depth images and of a room](scans/scans.png)

## Depth images with flying points

{images} depth images all around, {points:,} points together, as one cloud. At silhouettes, where another part of the
shape is more than {jump:g} pixels behind, {share:.0%} of the pixels see both and give a point somewhere between: a
flying point. *far*: share of all points that fly, at {far:g} or more from the surface. *found*: share of those that is
dropped. *lost*: share of the points that do not fly that is dropped with them.

CD (HD) of the surface; of that with `outliers=False`; of that of the points that do not fly; and of Open3D's Poisson
(PCA normals over 30 neighbours, oriented, depth 8), which closes what is open, of the points that its statistical
filter leaves ({neighbours} neighbours, {deviations:g} deviations). What no image shows counts as missing in all.

{shapes}

## A room from one spot

A scanner above the table of a furnished room takes points at equal angles, with Gaussian noise along its rays in per
cent of the longest side. What is close to it has points much closer together than the noise moves them. *dropped*:
points taken for strays; there are none. *to the surface*: from what was seen, without the noise; *to the truth*: from
the surface. Means (largest).

{rooms}

## A frame of a depth camera

A camera in that room takes a frame, {width} pixels wide, whose disparity (one over depth) has Gaussian noise, and is
rounded to whole steps. *step*: how far one is at the middle depth, in pixels there. *points*: from the points to the
truth, as they come and as they are moved. *to the truth*, *seen*: from the single layer to the truth, and to it from
what was seen. Means. *borders*, *pieces*: of the single layer. With `denoise=0` points stay where they are.

{frames}

## Voxels

Centres of the voxels that a surface meets (*occupied*), as of a scan that was binned, and of those inside it with
another outside beside a face (*segmented*), as of a mask; *across*: so many along its longest side. The latter lie
up to a voxel inside the surface, which is most of the error there. CD (HD), and how many pieces the double cover has.

{voxels}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    argparse.ArgumentParser(
        prog="python -m benchmarks.scans",
        description="Reconstruct what scanners make of known shapes and write docs/scans.md.",
        epilog="exit status: 0 done, 2 bad input (one line says what), 130 cancelled",
    ).parse_args(arguments)

    def command():
        print(f"wrote {write_page(measure(), DOCS)}")
        picture(DOCS / "scans" / "scans.png")
        return DONE

    return exit_status(command)


def measure() -> dict:
    """Everything that the page shows, printing what is done as it finishes."""
    check_open3d()
    scans = [(count, noise) for count in ROOM_POINTS for noise in ROOM_NOISE]
    return {
        "versions": versions(_LIBRARIES),
        "images": [said(name, measure_images(name)) for name in SHAPES],
        "rooms": [said(f"room, {count:,} points, {noise:g} %", measure_room(count, noise)) for count, noise in scans],
        "frames": [said(f"frame, steps of {step:g}, {noise:g}", measure_frame(step, noise)) for step, noise in FRAMES],
        "voxels": [
            said(f"{name}, {kind}, {across} voxels", measure_voxels(kind, name, across))
            for kind, name, across in VOXELS
        ],
    }


def measure_images(name: str, count: int = POINTS) -> dict:
    """What becomes of a shape's depth images, see `docs/scans.md`. A peer that crashes is left out."""
    truth = CASES[name].surface().mesh
    points, flying = depth_images(truth, count, np.random.default_rng(0))
    result = reconstruct(points)
    kept = kept_points(result, len(points))
    far = flying & (closest_points(points, truth)[0] >= FAR)
    peer = by_peer(_filtered_poisson, points, truth)
    return {
        "shape": name,
        "points": len(points),
        "flying": flying.mean(),
        "far": far.mean(),
        "found": 1.0 - kept[far].mean() if far.any() else None,
        "lost": 1.0 - kept[~flying].mean(),
        "ours": cd_and_hd(result.surface, truth),
        "all": cd_and_hd(reconstruct(points, Settings(outliers=False)).surface, truth),
        "none": cd_and_hd(reconstruct(points[~flying]).surface, truth),
        **({"poisson": peer} if peer else {}),
    }


def _filtered_poisson(points, truth):
    return cd_and_hd(poisson(without_strays(points))[0], truth)


def measure_room(count: int, percent: float) -> dict:
    """What becomes of a scan of the room, see `docs/scans.md`."""
    truth = rooms.room().mesh
    points, seen = seen_from_one_spot(truth, count, percent, np.random.default_rng(0))
    result = reconstruct(points)
    feet = surface_points(result.surface, _FEET, np.random.default_rng(0))
    ways = {"to_surface": (seen, result.surface), "to_truth": (feet, truth)}
    off = {name: 1e3 * closest_points(*way)[0] for name, way in ways.items()}
    return {
        "points": len(points),
        "percent": percent,
        "dropped": result.report["cleaning"]["outliers"],
        **{name: {"mean": found.mean(), "max": found.max()} for name, found in off.items()},
    }


def measure_frame(step: float, noise: float, width: int = FRAME_WIDTH) -> dict:
    """What becomes of a frame of a depth camera, as it is and as its points come, see `docs/scans.md`."""
    truth = before_camera(rooms.room().mesh)
    points, seen = depth_frame(truth, width, step, noise, np.random.default_rng(0))

    def found(settings):
        result = reconstruct(points, settings)
        mesh, facts = result.sheet, result.report["meshes"]["single"]
        feet = surface_points(mesh, _FEET, np.random.default_rng(0))
        ways = {"points": (result.points, truth), "to_truth": (feet, truth), "seen": (seen, mesh)}
        off = {name: 1e3 * closest_points(*way)[0].mean() for name, way in ways.items()}
        return {**off, "borders": facts["borders"], "pieces": facts["pieces"]}

    here, as_they_come = found(Settings(surface="single")), found(Settings(surface="single", denoise=0))
    return {"points": len(points), "step": step, "noise": noise, "ours": here, "as_they_come": as_they_come}


def measure_voxels(kind: str, name: str, across: int) -> dict:
    """What becomes of the voxels of a shape, see `docs/scans.md`. A peer that crashes is left out."""
    truth = CASES[name].surface().mesh
    points = occupied(truth, across, np.random.default_rng(0)) if kind == "occupied" else segmented(truth, across)

    def found(settings):
        result = reconstruct(points, settings)
        return {**cd_and_hd(result.surface, truth), "pieces": result.report["meshes"]["double"]["pieces"]}

    peer = by_peer(_poisson, points, truth)
    ways = {
        "ours": found(Settings()),
        "as_they_come": found(Settings(denoise=0)),
        **({"poisson": peer} if peer else {}),
    }
    return {"kind": kind, "shape": name, "across": across, "points": len(points), **ways}


def _poisson(points, truth):
    return cd_and_hd(poisson(points)[0], truth)


def write_page(measured: dict, docs: Path) -> Path:
    """Write scans.md and the numbers into the folder `docs`. Returns the page."""
    write_report(writable_folder(docs / "scans") / "numbers.json", measured)
    page = docs / "scans.md"
    text = _PAGE.format(
        versions=listed(measured["versions"]),
        images=IMAGES,
        points=POINTS,
        jump=JUMP,
        share=SHARE,
        far=1e3 * FAR,
        neighbours=FILTER[0],
        deviations=FILTER[1],
        shapes=markdown(_shapes(measured["images"])),
        rooms=markdown(_rooms(measured["rooms"])),
        width=FRAME_WIDTH,
        frames=markdown(_frames(measured["frames"])),
        voxels=markdown(_voxels(measured["voxels"])),
    )
    with atomic_path(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return page


def _shapes(rows):
    yield "shape", "far", "found", "lost", "here", "all points", "none flying", "filter, Poisson"
    for row in rows:
        found = "–" if row["found"] is None else f"{row['found']:.1%}"
        ways = cells(row, ("ours", "all", "none", "poisson"))
        yield row["shape"], f"{row['far']:.2%}", found, f"{row['lost']:.2%}", *ways


def _rooms(rows):
    yield "points", "noise, %", "dropped", "to the surface", "to the truth"
    for row in rows:
        off = (f"{row[way]['mean']:.2f} ({row[way]['max']:.0f})" for way in ("to_surface", "to_truth"))
        yield f"{row['points']:,}", f"{row['percent']:g}", f"{row['dropped']:,}", *off


def _frames(rows):
    yield "points", "step", "noise", "", "points", "to the truth", "seen", "borders", "pieces"
    for row in rows:
        for name, way in (("here", "ours"), ("`denoise=0`", "as_they_come")):
            off = (f"{row[way][of]:.2f}" for of in ("points", "to_truth", "seen"))
            counts = (str(row[way][of]) for of in ("borders", "pieces"))
            yield f"{row['points']:,}", f"{row['step']:g}", f"{row['noise']:g}", name, *off, *counts


def _voxels(rows):
    yield "voxels", "shape", "across", "points", "here", "pieces", "`denoise=0`", "pieces", "Poisson"
    for row in rows:
        ours, as_they_come, peer = cells(row, ("ours", "as_they_come", "poisson"))
        pieces = (str(row[way]["pieces"]) for way in ("ours", "as_they_come"))
        told = ours, next(pieces), as_they_come, next(pieces), peer
        yield row["kind"], row["shape"], str(row["across"]), f"{row['points']:,}", *told


def picture(path: Path) -> Path:
    """Points and surfaces of depth images and voxels of the tangle, of the noisiest scan of the room and of a frame."""
    figure, panels = sheet(3, 4)
    tangle = depth_images(CASES["tangle_10k"].surface().mesh, POINTS, np.random.default_rng(0))[0]
    room = seen_from_one_spot(rooms.room().mesh, ROOM_POINTS[-1], ROOM_NOISE[-1], np.random.default_rng(0))[0]
    frame = depth_frame(before_camera(rooms.room().mesh), FRAME_WIDTH, *FRAME_SHOWN, np.random.default_rng(0))[0]
    voxels = segmented(CASES["tangle_10k"].surface().mesh, 40)
    given = (
        ("depth images of a tangle", tangle, np.asarray, View(), panels[0, :2]),
        ("a room from one spot", room, np.asarray, View((0.5, -1.0, 0.9)), panels[0, 2:]),
        ("a frame of a depth camera", frame, in_room, View((-1.0, -0.3, 0.6)), panels[1, :3]),
        ("voxels of a tangle", voxels, np.asarray, View(), panels[2, :3]),
    )
    for name, points, place, view, (left, right, *further) in given:
        camera = view.camera(place(points), _PIXELS)
        draw_points(left, place(points), camera)
        caption(left, name, f"{len(points):,} points")
        for panel, settings in zip((right, *further), (Settings(), Settings(denoise=0)), strict=False):
            cover = reconstruct(points, settings).surface
            draw_surface(panel, replace(cover, vertices=place(cover.vertices)), camera, view)
        for panel in further:
            caption(panel, "of its points as they come")
    return save(figure, path)


if __name__ == "__main__":
    sys.exit(main())
