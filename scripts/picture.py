"""One picture of a reconstruction: its points, its normals, a cut through its field and its surface."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from scipy.spatial import KDTree

from core import DistanceField, Mesh

from .render import Camera, dome_light, render, turned_discs

INK, QUIET, ACCENT = "#1b2430", "#66707c", "#e4572e"
CLAY = np.array([0.93, 0.88, 0.80])
NEAR, FAR = np.array([0.09, 0.20, 0.33]), np.array([0.78, 0.85, 0.91])
DISTANCES = LinearSegmentedColormap.from_list("distances", ["#fdfdfb", "#cfe3ea", "#86b7cc", "#3f7fa3", "#1d4a70"])
ROWS, COLUMNS = 900, 720
KEY_LIGHT = -0.6, 0.7, 1.0
ISOLINES = 9


def save_picture(
    path: Path,
    points: np.ndarray,
    normals: np.ndarray,
    field: DistanceField,
    surface: Mesh,
    towards: Sequence[float],
    cut: int,
) -> None:
    """Write a PNG of four panels.

    points, normals : (n,3) float64; the sign of a normal does not matter
    towards         : (3,) direction from the object to the viewer; Z is up
    cut             : 0 or 1, the axis (x or y) across which the field is cut, at the middle of the points
    """
    camera = Camera.facing(points, towards, (0, 0, 1), (ROWS, COLUMNS))
    key = np.array(KEY_LIGHT) @ camera.axes
    place = 0.5 * (points[:, cut].min() + points[:, cut].max())
    spacing = np.median(KDTree(points).query(points, 2)[0][:, 1])
    shape = " × ".join(map(str, field.values.shape))
    titles = {
        "Input": f"{len(points):,} points, no normals",
        "Normals": "axes without sign, one colour per direction",
        "Distance field": f"{shape} nodes, cut at {'xy'[cut]} = {place:.2f}",
        "Surface": f"closed double cover, {len(surface.faces):,} triangles",
    }
    with plt.rc_context({"font.family": "DejaVu Sans", "text.color": INK}):
        figure = plt.figure(figsize=(18, 6.4), facecolor="white")
        panels = [figure.add_axes([0.01 + 0.248 * k, 0.015, 0.236, 0.84]) for k in range(len(titles))]
        for axes, (title, note) in zip(panels, titles.items(), strict=True):
            axes.set_axis_off()
            left = axes.get_position().x0 + 0.006
            figure.text(left, 0.95, title, fontsize=17, weight="bold", va="center")
            figure.text(left, 0.903, note, fontsize=11.5, color=QUIET, va="center")
        panels[0].imshow(points_image(points, spacing, camera), interpolation="lanczos")
        panels[1].imshow(normals_image(points, normals, spacing, camera), interpolation="lanczos")
        draw_cut(panels[2], field, surface, cut, place, camera.extent)
        panels[3].imshow(surface_image(surface, camera, key), interpolation="lanczos")
        figure.savefig(path, dpi=90)
        plt.close(figure)


def points_image(points: np.ndarray, spacing: float, camera: Camera) -> np.ndarray:
    """The points (n,3) as round dots, paler with depth, (rows,columns,4)."""
    towards = np.broadcast_to(camera.axes[2], points.shape)
    near = points @ camera.axes[2]
    near = (near - near.min()) / np.ptp(near)
    colours = FAR + near[:, None] * (NEAR - FAR)
    return render(*turned_discs(points, towards, 0.3 * spacing), np.repeat(colours, 8, axis=0), camera)


def normals_image(points: np.ndarray, normals: np.ndarray, spacing: float, camera: Camera) -> np.ndarray:
    """Every point as a disc across its axis, coloured by the axis as seen from the camera, (rows,columns,4)."""
    seen = normals @ camera.axes.T
    seen *= np.where(seen[:, 2:] < 0, -1, 1)
    colours = (0.62 + 0.38 * seen) * (0.55 + 0.45 * seen[:, 2:])
    vertices, faces = turned_discs(points, normals, 0.8 * spacing)
    return render(vertices, faces, np.repeat(colours, 8, axis=0), camera, cull=False)


def surface_image(mesh: Mesh, camera: Camera, key: np.ndarray) -> np.ndarray:
    """The mesh as if cut in clay, lit from the direction `key` (3,), (rows,columns,4)."""
    light = dome_light(mesh.vertices, mesh.faces, key, (0, 0, 1))
    return render(mesh.vertices, mesh.faces, light[:, None] * CLAY, camera)


def draw_cut(axes: plt.Axes, field: DistanceField, surface: Mesh, cut: int, place: float, extent: float) -> None:
    """Draw the field on the plane where axis `cut` is `place`, `extent` high, and the surface that the plane meets."""
    across, up = 1 - cut, 2
    u, v = (field.origin[k] + field.spacing * np.arange(field.values.shape[k]) for k in (across, up))
    nodes = np.empty((len(v), len(u), 3))
    nodes[..., cut], nodes[..., across], nodes[..., up] = place, u, v[:, None]
    values = field.sample(nodes.reshape(-1, 3)).reshape(len(v), len(u))
    bounds = u[0], u[-1], v[0], v[-1]
    axes.imshow(values, cmap=DISTANCES, vmin=0, origin="lower", extent=bounds, interpolation="bicubic")
    axes.contour(u, v, values, ISOLINES, colors="white", linewidths=0.8, alpha=0.75)
    segments = plane_section(surface, cut, place)[:, :, [across, up]]
    axes.add_collection(LineCollection(segments, colors=ACCENT, linewidths=1.6, capstyle="round"))
    middle_u, middle_v = 0.5 * (u[0] + u[-1]), 0.5 * (v[0] + v[-1])
    axes.set_xlim(middle_u - 0.36 * extent, middle_u + 0.36 * extent)
    axes.set_ylim(middle_v - 0.48 * extent, middle_v + 0.48 * extent)


def plane_section(mesh: Mesh, axis: int, place: float) -> np.ndarray:
    """The segments, (s,2,3), in which the mesh meets the plane where coordinate `axis` is `place`."""
    above = mesh.vertices[:, axis] > place
    corners = mesh.faces[above[mesh.faces].any(axis=1) & ~above[mesh.faces].all(axis=1)]
    start, end = corners, np.roll(corners, -1, axis=1)
    crossed = above[start] != above[end]
    a, b = mesh.vertices[start[crossed]], mesh.vertices[end[crossed]]
    share = (place - a[:, axis]) / (b[:, axis] - a[:, axis])
    return (a + share[:, None] * (b - a)).reshape(-1, 2, 3)
