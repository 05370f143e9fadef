"""Panels of the gallery: points, surfaces cut open, errors of normals."""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from PIL import Image
from scipy.spatial import KDTree

from core import Mesh
from core.io.atomic import atomic_path
from scripts.picture import ACCENT, CLAY, INK, KEY_LIGHT, QUIET, plane_section, points_image
from scripts.render import Camera, dome_light, render, turned_discs

from .geometry import closest_points, face_normals, surface_samples

_LIGHTS = 40
_WORST_ANGLE = 30.0
_ERRORS = LinearSegmentedColormap.from_list("errors", ["#c3cdd6", "#f0a35e", ACCENT, "#7a1626", "#16060a"])
_DPI = 90
_DISCS = 25_000


@dataclass(frozen=True)
class View:
    """How a shape is looked at.

    towards : (3,) direction to the viewer; Z is up
    cut     : axis (0, 1 or 2) across which it is cut open, None for whole
    place   : coordinate of the cut; what lies beyond it, on the viewer's side, is taken away
    """

    towards: tuple[float, float, float] = (-0.6, -1.0, 0.75)
    cut: int | None = None
    place: float = 0.0

    def camera(self, points: np.ndarray, pixels: int) -> Camera:
        return Camera.facing(points, self.towards, (0, 0, 1), (pixels, pixels))


def draw_points(axes: plt.Axes, points: np.ndarray, camera: Camera) -> None:
    """Dots, paler with depth."""
    size = max(spacing_of(points), 4 * camera.pixel)
    axes.imshow(points_image(points, size, camera), interpolation="lanczos")


def draw_surface(axes: plt.Axes, cover: Mesh, camera: Camera, view: View) -> None:
    """A double cover in clay, cut open as the view says, with the edge of the cut in colour."""
    faces, segments = cover.faces, np.empty((0, 2, 3))
    if view.cut is not None:
        side = np.sign(view.towards[view.cut])
        faces = faces[(side * cover.vertices[faces, view.cut] < side * view.place).all(axis=1)]
        segments = plane_section(cover, view.cut, view.place)
    light = dome_light(cover.vertices, faces, np.array(KEY_LIGHT) @ camera.axes, (0, 0, 1), _LIGHTS)
    axes.imshow(render(cover.vertices, faces, light[:, None] * CLAY, camera), interpolation="lanczos")
    ends = camera.project(segments.reshape(-1, 3)).reshape(-1, 2, 3)[:, :, :2]
    axes.add_collection(LineCollection(ends, colors=ACCENT, linewidths=1.2, capstyle="round"))


def draw_errors(axes: plt.Axes, points: np.ndarray, axes_found: np.ndarray, truth: np.ndarray, camera: Camera) -> None:
    """Every point as a disc across its true normal, coloured by the angle to the one found."""
    agreement = np.abs(np.einsum("ni,ni->n", axes_found, truth)).clip(0, 1)
    colours = _ERRORS(np.degrees(np.arccos(agreement)) / _WORST_ANGLE)[:, :3]
    vertices, faces = turned_discs(points, truth, 0.9 * spacing_of(points))
    axes.imshow(render(vertices, faces, np.repeat(colours, 8, axis=0), camera, cull=False), interpolation="lanczos")


def draw_distances(axes: plt.Axes, mesh: Mesh, truth: Mesh, worst: float, camera: Camera) -> None:
    """Points of the mesh as discs on it, coloured by their distance to the truth; `worst` and more is darkest."""
    points, face = surface_samples(mesh, _DISCS, np.random.default_rng(0))
    colours = _ERRORS(closest_points(points, truth)[0] / worst)[:, :3]
    radius = 1.2 * np.sqrt(mesh.face_areas().sum() / _DISCS)
    vertices, faces = turned_discs(points, face_normals(mesh)[face], radius)
    axes.imshow(render(vertices, faces, np.repeat(colours, 8, axis=0), camera, cull=False), interpolation="lanczos")


def error_scale(figure: plt.Figure, panels) -> None:
    """The colour bar of :func:`draw_errors`."""
    scale = plt.cm.ScalarMappable(Normalize(0, _WORST_ANGLE), _ERRORS)
    figure.colorbar(scale, ax=panels, label="degrees off, and more", shrink=0.7, pad=0.01)


def sheet(rows: int, columns: int, size: float = 2.6):
    """A figure of empty square panels, and the panels (rows,columns)."""
    with plt.rc_context({"font.family": "DejaVu Sans", "text.color": INK, "axes.titlecolor": INK}):
        figure, panels = plt.subplots(
            rows, columns, figsize=(size * columns, (size + 0.28) * rows), layout="constrained", squeeze=False
        )
    figure.get_layout_engine().set(h_pad=0.1)
    for panel in panels.flat:
        panel.set_axis_off()
    return figure, panels


def caption(panel: plt.Axes, title: str, note: str = "") -> None:
    panel.set_title(title, fontsize=10.5, weight="bold", color=INK, pad=14 if note else 4)
    if note:
        panel.text(0.5, 1.01, note, transform=panel.transAxes, fontsize=8.5, color=QUIET, ha="center", va="bottom")


def save(figure: plt.Figure, path: Path) -> Path:
    """Write a PNG of at most 128 colours, which keeps it small."""
    buffer = BytesIO()
    figure.savefig(buffer, dpi=_DPI)
    plt.close(figure)
    picture = Image.open(buffer).convert("RGB").quantize(128, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    with atomic_path(path) as temporary:
        picture.save(temporary, format="png", optimize=True)
    return path


def spacing_of(points: np.ndarray) -> float:
    """Median distance to the nearest other point."""
    return float(np.median(KDTree(points).query(points, 2)[0][:, 1]))
