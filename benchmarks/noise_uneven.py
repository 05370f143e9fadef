"""Uneven density, holes and wires: what becomes of them with no setting touched."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from core import Mesh, Settings, reconstruct

from .geometry import surface_samples
from .noise_measure import by_peer, cd_and_hd
from .peers import poisson
from .pictures import View, caption, draw_points, draw_surface, save, sheet
from .sampling import graded, pierced, uniform, wires
from .shapes import closed
from .shapes.surface import Surface

BRIDGE = 8.0  # local spacings

_THIRDS = 200, 1_000, 5_000
_PIXELS = 380
_TORUS = View((-0.4, -1.0, 1.1))


def mixed(surface: Surface, rng: np.random.Generator) -> np.ndarray:
    """Points (n,3) at the densities of 200, 1,000 and 5,000 on the whole surface, each on a third of it along x."""
    points = surface_samples(surface.mesh, 3 * max(_THIRDS), rng)[0]
    third = np.digitize(points[:, 0], np.percentile(points[:, 0], (100 / 3, 200 / 3)))
    return np.concatenate([points[third == i][: count // 3] for i, count in enumerate(_THIRDS)])


def _made(way: Callable, count: int) -> Callable:
    return lambda surface, rng: way(surface, count, rng)[0]


UNEVEN: dict[str, tuple[Callable[[], Surface], Callable, View]] = {
    "torus, 2,000 points": (closed.torus, _made(uniform, 2_000), _TORUS),
    "torus, mixed as 200, 1,000 and 5,000": (closed.torus, mixed, _TORUS),
    "torus, 30-fold graded": (closed.torus, _made(graded, 2_000), _TORUS),
    "torus, wires alone": (closed.torus, _made(wires, 3_000), _TORUS),
    "bumps, 12 holes of 6 spacings": (closed.bumps, _made(pierced, 10_000), View()),
}


def measure(name: str) -> dict:
    """CD and HD of the default mesh, of that with wider gaps bridged, and, unless it crashes, of Open3D's Poisson."""
    points, truth = _points_and_truth(name)
    row = {
        "shape": name,
        "points": len(points),
        "ours": cd_and_hd(reconstruct(points).surface, truth),
        "bridged": cd_and_hd(reconstruct(points, Settings(bridge=BRIDGE)).surface, truth),
    }
    found = by_peer(_poisson, points, truth)
    return row | ({"poisson": found} if found else {})


def picture(path: Path) -> Path:
    """Points and surfaces of those that are not even."""
    figure, panels = sheet(2, len(UNEVEN) - 1)
    for (above, below), (name, (_, _, view)) in zip(panels.T, list(UNEVEN.items())[1:], strict=True):
        points, _ = _points_and_truth(name)
        camera = view.camera(points, _PIXELS)
        draw_points(above, points, camera)
        caption(above, name.split(", ", 1)[1], f"{len(points):,} points")
        draw_surface(below, reconstruct(points).surface, camera, view)
    return save(figure, path)


def _poisson(points, truth):
    return cd_and_hd(poisson(points)[0], truth)


def _points_and_truth(name) -> tuple[np.ndarray, Mesh]:
    shape, take, _ = UNEVEN[name]
    surface = shape()
    return take(surface, np.random.default_rng(0)), surface.mesh
