"""Figures of the gallery that show the method at work: its steps in the plane, rounds against noise, cut fields."""

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection

from core import Settings, local_spacing, reconstruct
from core.normals.estimate import estimate_normals
from scripts.picture import ACCENT, DISTANCES, INK, QUIET, draw_cut, plane_section

from . import plane
from .alternation import best_moves
from .geometry import closest_points
from .pictures import View, caption, draw_surface, save, sheet
from .sampling import blue_noise
from .shapes import bordered, closed, junctions, one_sided

_NODES = 221
_LEVELS = np.arange(0.0, 0.5, 0.02)
_SLAB = 0.02  # half the thickness of the slice of points that is shown
_ROUNDS = (1, 2, 4)
_NOISE = 0.008  # 1 % of the longest side


def pipeline(path: Path) -> Path:
    """The steps on a planar curve: bisectors, axes, diffused directions, and what either integration makes of them."""
    points = plane.curve()
    pairs, edges = plane.bisectors(points)
    axes = plane.normals(points, pairs, edges)
    x, step = plane.nodes(points, _NODES)
    directions = plane.diffused(points, axes, x)
    figure, panels = sheet(1, 5, 3.2)
    for panel in panels[0]:
        panel.set_aspect("equal")
        panel.set_xlim(x[0, 0, 0], x[-1, 0, 0])
        panel.set_ylim(x[0, 0, 1], x[0, -1, 1])
    h = plane.spacing_of(points)
    _lines(panels[0, 0], edges, QUIET, 0.9)
    _lines(panels[0, 1], np.stack([points - 0.9 * h * axes, points + 0.9 * h * axes], axis=1), ACCENT, 1.6)
    few = slice(6, None, 13)
    starts, arrows = x[few, few].reshape(-1, 2), 0.035 * directions[few, few].reshape(-1, 2)
    panels[0, 2].quiver(
        *(starts - arrows / 2).T, *arrows.T, color=DISTANCES(0.8), angles="xy", scale_units="xy", scale=1, width=0.006
    )
    for panel, field in (
        (panels[0, 3], plane.integrated(points, directions, x, step)),
        (panels[0, 4], plane.to_patches(points, axes, x)),
    ):
        panel.contourf(x[..., 0], x[..., 1], field, _LEVELS, cmap=DISTANCES, extend="min")
        panel.contour(x[..., 0], x[..., 1], field, _LEVELS[1:], colors="white", linewidths=0.7)
        panel.contour(x[..., 0], x[..., 1], field, [0.006], colors=ACCENT, linewidths=1.2)
    for panel in panels[0, :4]:
        panel.plot(*points.T, ".", color=INK, markersize=4)
    caption(panels[0, 0], "bisectors", f"{len(points)} points")
    caption(panels[0, 1], "axes", "mirror images in the bisectors agree")
    caption(panels[0, 2], "diffused directions", "signed by the side")
    caption(panels[0, 3], "integrated: Poisson", "as published: a valley past the end")
    caption(panels[0, 4], "distance to patches", "as here: the curve ends")
    return save(figure, path)


def _lines(panel, segments, colour, width):
    panel.add_collection(LineCollection(segments, colors=colour, linewidths=width, capstyle="round"))


def rounds(path: Path) -> Path:
    """Noise taken off: rounds of the paper's alternation, and the default; a slice of the points, and the surface."""
    surface = closed.bumps()
    given, _ = blue_noise(surface, 4_000, np.random.default_rng(0))
    given = given + _NOISE * np.random.default_rng(1).normal(size=given.shape)
    raw, view = Settings(denoise=0), View((-0.4, -1.0, 0.5))
    shown, moved = {"as they come": given}, given
    for turn in range(1, max(_ROUNDS) + 1):
        axes = estimate_normals(moved, local_spacing(moved), Settings(), progress=None)[0]
        moved = moved + best_moves(moved, axes, given)
        if turn in _ROUNDS:
            shown[f"{turn} round{'s' if turn > 1 else ''}"] = moved
    results = {title: reconstruct(points, raw) for title, points in shown.items()}
    results["the default"] = reconstruct(given)
    truth = plane_section(surface.mesh, 1, 0.0)[:, :, [0, 2]]
    camera = view.camera(surface.mesh.vertices, 380)
    figure, panels = sheet(2, len(results))
    for (above, below), (title, result) in zip(panels.T, results.items(), strict=True):
        near = np.abs(result.points[:, 1]) < _SLAB
        _lines(above, truth, ACCENT, 1.0)
        above.plot(*result.points[near][:, [0, 2]].T, ".", color=INK, markersize=2.5)
        above.set_aspect("equal")
        off = 1e3 * closest_points(result.points, surface.mesh)[0].mean()
        caption(above, title, f"points {off:.1f} × 10⁻³ off")
        draw_surface(below, result.surface, camera, view)
    return save(figure, path)


def cuts(path: Path) -> Path:
    """The field across shapes that have no inside: open, meeting, one-sided."""
    upright, lying = [0, 1, 2], [0, 2, 1]
    shown = [
        ("cloth", bordered.cloth, 10_000, upright),
        ("petals", bordered.petals, 10_000, upright),
        ("roll", junctions.toilet_paper, 10_000, lying),
        ("sweet", junctions.candy, 10_000, upright),
        ("Klein bottle", one_sided.klein, 10_000, upright),
    ]
    figure, panels = sheet(1, len(shown))
    for panel, (title, make, count, order) in zip(panels[0], shown, strict=True):
        points = blue_noise(make(), count, np.random.default_rng(0))[0][:, order]
        result = reconstruct(points)
        draw_cut(panel, result.field, result.surface, 1, 0.03, 1.0)
        middle, half = (points.min(axis=0) + points.max(axis=0)) / 2, 0.56 * np.ptp(points, axis=0)[[0, 2]].max()
        panel.set_xlim(middle[0] - half, middle[0] + half)
        panel.set_ylim(middle[2] - half, middle[2] + half)
        caption(panel, title, f"{count:,} points")
    return save(figure, path)
