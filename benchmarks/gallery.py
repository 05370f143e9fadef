"""`python -m benchmarks.gallery`: the pictures of the README and of docs/limits.md, into docs/gallery/.

Every surface is the double cover at default settings unless the panel says otherwise.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from core import Settings, reconstruct
from core.io.atomic import writable_folder
from core.normals.pca import pca_normals

from .pictures import View, caption, draw_errors, draw_points, draw_surface, error_scale, save, sheet
from .sampling import blue_noise, pierced, uniform, wires
from .shapes import closed, junctions, one_sided, open
from .shapes.surface import Surface
from .status import DONE, exit_status

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "gallery"
_PIXELS = 420
_PCA_NEIGHBOURS = 12


def shapes(path: Path) -> Path:
    """README: five kinds of surface, the points above and what comes of them below, cut open."""
    shown = [
        ("cloth, open", open.cloth, 10_000, View((-0.6, -1.0, 0.9))),
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
            f"plane fit, {_PCA_NEIGHBOURS} nearest": pca_normals(result.points, _PCA_NEIGHBOURS)[0],
        }
        for panel, (name, found) in zip((above, below), ways.items(), strict=True):
            there = truth[result.source_index]
            draw_errors(panel, result.points, found, there, camera)
            agreement = np.abs(np.einsum("ni,ni->n", found, there)).mean()
            caption(panel, f"{title}: {name}", f"{count:,} points, NC {agreement:.4f}")
    error_scale(figure, panels)
    return save(figure, path)


def gaps(path: Path) -> Path:
    """Holes and wires: what the default bridges, and what a larger `bridge` does."""
    holed, _ = pierced(closed.bumps(), 10_000, np.random.default_rng(0))
    caged, _ = wires(closed.torus(), 3_000, np.random.default_rng(0))
    figure, panels = sheet(2, 4)
    tried = [("holes six spacings wide", holed, View(), (3.0, 8.0, 14.0))]
    tried.append(("wires", caged, View((-0.4, -1.0, 1.1)), (3.0, 10.0, 20.0)))
    for row, (title, points, view, bridges) in zip(panels, tried, strict=True):
        camera = view.camera(points, _PIXELS)
        draw_points(row[0], points, camera)
        caption(row[0], title, f"{len(points):,} points")
        for panel, bridge in zip(row[1:], bridges, strict=True):
            draw_surface(panel, reconstruct(points, Settings(bridge=bridge)).surface, camera, view)
            caption(panel, f"bridge {bridge:g}{', the default' if bridge == Settings().bridge else ''}")
    return save(figure, path)


def control(path: Path) -> Path:
    """Sparse points of one cupped petal: the axes of the outermost points left alone, or held at two slants."""
    points, truth = blue_noise(_one_petal(), 150, np.random.default_rng(0))
    rim = np.flatnonzero(points[:, 0] > np.quantile(points[:, 0], 0.8))
    view = View((-0.3, -1.0, 0.35))
    camera = view.camera(points * 1.15, _PIXELS)
    figure, panels = sheet(1, 4)
    draw_points(panels[0, 0], points, camera)
    caption(panels[0, 0], "150 points")
    for panel, (title, slant) in zip(
        panels[0, 1:], {"axes found": None, "end held 35° up": 35, "end held 35° down": -35}.items(), strict=True
    ):
        held = None if slant is None else (rim, _turned(truth[rim], np.radians(slant)))
        draw_surface(panel, reconstruct(points, constraints=held).surface, camera, view)
        caption(panel, title)
    return save(figure, path)


def _one_petal() -> Surface:
    from .shapes.surface import Patch, from_patches

    def position(uv):
        across, out = 2 * uv[:, 0] - 1, uv[:, 1]
        width = 0.15 + 0.35 * np.sin(np.pi * out * 0.85)
        return np.stack([out, across * width, 0.4 * out**2 + 0.2 * across**2 * width], axis=1)

    return from_patches([Patch(position, (60, 80))])


def _turned(axes, angle):
    """The axes (n,3) turned about y."""
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    return axes @ turn.T


FIGURES = {"shapes": shapes, "normals": normals, "gaps": gaps, "control": control}


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
