"""`python -m benchmarks.gallery`: the pictures of the README, docs/figures.md and docs/limits.md, into docs/gallery/.

Every surface is the double cover at default settings unless the panel says otherwise.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from core import Settings, reconstruct
from core.io.atomic import writable_folder
from core.normals.pca import pca_normals

from .catalogue import sampled
from .metrics import surface_errors
from .peers import PEERS, check_open3d
from .pictures import View, caption, draw_distances, draw_errors, draw_points, draw_surface, error_scale, save, sheet
from .sampling import blue_noise, pierced, uniform
from .shapes import bordered, closed, junctions, one_sided
from .starts import USUAL
from .status import DONE, exit_status
from .steps import cuts, pipeline, rounds

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "gallery"
_PIXELS = 420
_PCA_NEIGHBOURS = 12


def shapes(path: Path) -> Path:
    """README: five kinds of surface, the points above and what comes of them below, cut open."""
    shown = [
        ("cloth, open", bordered.cloth, 10_000, View((-0.6, -1.0, 0.9))),
        ("roll, sheets that meet", junctions.toilet_paper, 10_000, View((-0.5, -0.9, 0.9))),
        ("sweet, cut in half", junctions.candy, 10_000, View((-0.35, -1.0, 0.45), 1, 0.0)),
        ("Boy's surface, one side, cut", one_sided.boy, 10_000, View((-0.6, -1.0, 0.5), 1, -0.05)),
        ("genus 5, cut", closed.tangle, 10_000, View((-0.5, -1.0, 0.6), 1, -0.12)),
    ]
    figure, panels = sheet(2, len(shown))
    for (above, below), (title, make, count, view) in zip(panels.T, shown, strict=True):
        points, _ = blue_noise(make(), count, np.random.default_rng(0))
        _pair(above, below, points, view)
        caption(above, title, f"{count:,} points")
    return save(figure, path)


def _pair(above, below, points, view, settings=Settings(), constraints=None):
    camera = view.camera(points, _PIXELS)
    draw_points(above, points, camera)
    draw_surface(below, reconstruct(points, settings, constraints=constraints).surface, camera, view)


def normals(path: Path) -> Path:
    """Angle between found and true normals, by the sweeps and by a plane fit."""
    shown = [
        ("roll", junctions.toilet_paper, 10_000, View((-0.5, -0.9, 0.9))),
        ("fish", junctions.fish, 3_000, View((-0.2, -0.4, 1.0))),
        ("paper plane", junctions.paper_plane, 1_000, View((-0.6, -1.0, 0.9))),
    ]
    figure, panels = sheet(2, len(shown))
    for (above, below), (title, make, count, view) in zip(panels.T, shown, strict=True):
        points, truth = uniform(make(), count, np.random.default_rng(0))
        camera = view.camera(points, _PIXELS)
        result = reconstruct(points, Settings(surface="none", outliers=False))
        ways = {
            "sweeps": result.normals,
            f"plane fit to {_PCA_NEIGHBOURS} nearest": pca_normals(result.points, _PCA_NEIGHBOURS)[0],
        }
        for panel, (name, found) in zip((above, below), ways.items(), strict=True):
            there = truth[result.source_index]
            draw_errors(panel, result.points, found, there, camera)
            agreement = np.abs(np.einsum("ni,ni->n", found, there)).mean()
            caption(panel, f"{title}, {count:,} points", f"{name}: NC {agreement:.4f}")
    error_scale(figure, panels)
    return save(figure, path)


def gaps(path: Path) -> Path:
    """Holes, which the default leaves open and a larger `bridge` closes; wires, contours, slices and rows, which it
    joins."""
    holed, _ = pierced(closed.bumps(), 10_000, np.random.default_rng(0))
    figure, (above, *below) = sheet(3, 4)
    camera = View().camera(holed, _PIXELS)
    draw_points(above[0], holed, camera)
    caption(above[0], "holes six spacings wide", f"{len(holed):,} points")
    for panel, bridge in zip(above[1:], (Settings().bridge, 8.0, 14.0), strict=True):
        draw_surface(panel, reconstruct(holed, Settings(bridge=bridge)).surface, camera, View())
        caption(panel, f"bridge {bridge:g}{', the default' if bridge == Settings().bridge else ''}")
    lines = (
        ("wires", sampled("torus_wires_3k")[1], View((-0.4, -1.0, 1.1))),
        ("contours", sampled("relief_contours_8k")[1], View()),
        ("slices, eight steps apart", _slices(), View((-0.5, -1.0, 0.4))),
        ("rows, fifteen steps apart", _scan_rows(), View((0.4, -1.0, 0.9))),
    )
    for (left, right), (title, points, view) in zip(np.reshape(below, (4, 2)), lines, strict=True):
        camera = view.camera(points, _PIXELS)
        draw_points(left, points, camera)
        caption(left, title, f"{len(points):,} points")
        draw_surface(right, reconstruct(points).surface, camera, view)
        caption(right, "the default")
    return save(figure, path)


def _slices(step=0.02, apart=8):
    """Points on level slices of a twisted vase, a step along each, and so many from one to the next."""
    rings = []
    for height in np.arange(0, 2, apart * step):
        radius = 0.5 + 0.15 * np.sin(2.5 * height)
        turn = np.linspace(0, 2 * np.pi, int(2 * np.pi * radius / step), endpoint=False)
        away = radius * (1 + 0.12 * np.cos(5 * turn + 1.5 * height))
        rings.append(np.stack([away * np.cos(turn), away * np.sin(turn), np.full(len(turn), height)], axis=1))
    return np.concatenate(rings)


def _scan_rows(step=0.01, apart=15):
    """Points in rows on a wavy sheet."""
    x, y = (axis.reshape(-1) for axis in np.meshgrid(np.arange(-0.5, 0.5, step), np.arange(-0.5, 0.5, apart * step)))
    return np.stack([x, y, 0.15 * np.sin(3 * x) * np.cos(2 * y)], axis=1)


def limits(path: Path) -> Path:
    """Where the defaults fail: too few points, sheets too close, heavy noise, few points at junctions."""
    rng = np.random.default_rng(0)
    knot, _ = uniform(closed.knot(), 10_000, rng)
    close, (fruit, _) = _two_sheets(rng), blue_noise(junctions.strawberry(), 1_000, rng)
    shown = [
        ("too few points", blue_noise(closed.torus(), 100, rng)[0], View((-0.4, -1.0, 1.1))),
        ("sheets 0.6 spacing apart", close, View((-0.5, -1.0, 0.35), 1, 0.0)),
        ("noise of 1.5 %", knot + 0.012 * rng.normal(size=knot.shape), View((-0.3, -0.6, 1.0))),
        ("few points at junctions", fruit, View((-0.5, -1.0, 0.6), 1, 0.0)),
    ]
    figure, panels = sheet(2, len(shown))
    for (above, below), (title, points, view) in zip(panels.T, shown, strict=True):
        _pair(above, below, points, view)
        caption(above, title, f"{len(points):,} points")
    return save(figure, path)


def _two_sheets(rng):
    """Random points of two flat squares 0.012 apart, on each of which they are 0.02 apart on average."""
    points = rng.uniform(-0.4, 0.4, (3_200, 3))
    points[:, 2] = np.repeat([0.0, 0.012], 1_600)
    return points


def lost(path: Path) -> Path:
    """A case on which a peer has less error: our surface and that peer's, coloured by the distance to the truth."""
    check_open3d()
    surface = closed.bumps()
    points, _ = blue_noise(surface, 100_000, np.random.default_rng(0))
    peer, worst, camera = PEERS["pivoting"], 0.1, View().camera(points, _PIXELS)
    other = peer.finish(peer.prepare(points, USUAL), peer.variants[0])
    meshes = {"VAD": reconstruct(points).surface, peer.title: other}
    figure, (panels,) = sheet(1, len(meshes))
    for panel, (way, mesh) in zip(panels, meshes.items(), strict=True):
        draw_distances(panel, mesh, surface.mesh, worst * 1e-3, camera)
        off = surface_errors(mesh, surface.mesh)
        caption(panel, f"{len(points):,} points: {way}", f"CD {off['cd']:.3f}, HD {off['hd']:.1f}, scale to {worst}")
    return save(figure, path)


def control(path: Path) -> Path:
    """Rows of points that may be shelves or walls: axes found, held flat at two sides, held upright above and below."""
    points = _rows()
    reach = np.abs(points).max(axis=0) - 0.05
    held = {
        "axes found": None,
        "outermost held level": (np.abs(points[:, 0]) > reach[0], (0, 0, 1)),
        "outermost held upright": (np.abs(points[:, 2]) > reach[2], (1, 0, 0)),
    }
    view = View((-0.45, -1.0, 0.55))
    camera = view.camera(points, _PIXELS)
    figure, panels = sheet(1, 4)
    draw_points(panels[0, 0], points, camera)
    caption(panels[0, 0], "shelves or walls?", f"{len(points)} points")
    for panel, (title, choice) in zip(panels[0, 1:], held.items(), strict=True):
        rows = np.flatnonzero(choice[0]) if choice else []
        constraints = (rows, np.tile(choice[1], (len(rows), 1)).astype(float)) if choice else None
        draw_surface(panel, reconstruct(points, constraints=constraints).surface, camera, view)
        caption(panel, title, f"{len(rows)} points held")
    return save(figure, path)


def _rows():
    """Thirteen points in each of 6 x 5 rows a square mesh apart, shaken a little."""
    x, y, z = 0.2 * (np.arange(6) - 2.5), 0.1 * (np.arange(13) - 6), 0.2 * (np.arange(5) - 2)
    points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    return points + np.random.default_rng(0).normal(size=points.shape) * 0.006


FIGURES = {
    "shapes": shapes,
    "pipeline": pipeline,
    "cuts": cuts,
    "normals": normals,
    "rounds": rounds,
    "gaps": gaps,
    "control": control,
    "limits": limits,
    "lost": lost,
}


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gallery", description=__doc__)
    parser.add_argument("figures", metavar="FIGURE", nargs="*", help=f"only these, of {', '.join(FIGURES)}")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where to (default: docs/gallery)")
    given = parser.parse_args(arguments)
    if unknown := set(given.figures) - set(FIGURES):
        parser.error(f"no figure is called {', '.join(unknown)}")

    def command():
        folder = writable_folder(given.folder)
        for name in given.figures or FIGURES:
            print(f"wrote {FIGURES[name](folder / f'{name}.png')}", flush=True)
        return DONE

    return exit_status(command)


if __name__ == "__main__":
    sys.exit(main())
