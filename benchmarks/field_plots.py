"""The plots of docs/field.md."""

from io import BytesIO
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from core.io.atomic import atomic_path
from scripts.picture import DISTANCES
from scripts.render import Camera, render, vertex_normals

from .plots import ACCENT, COLOURS, INK, QUIET, STYLE

STEP = 0.02  # between iso-lines
_VIEW = 0.75  # of the cut's direction towards the viewer; the rest is from above
_IMAGE = 520, 560
_WAYS = ACCENT, "#c9a227", "#17344f", "#3f7fa3", "#6a8d55"
_DPI = 80
_COLOURS_KEPT = 64


def plot_lines(path: Path, numbers: dict[str, dict], pictures: dict[str, dict]) -> None:
    """Cuts of the hat's and the bottle's field with the line, and u and d along it; see `field_lines.lines`."""
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(10, 7.5), layout="constrained")
        rows = figure.subfigures(len(numbers), 1)
        for row, (name, found) in zip(rows, numbers.items(), strict=True):
            layout = row.add_gridspec(2, 2, width_ratios=(1, 1.6), height_ratios=(2, 1))
            cut = row.add_subplot(layout[:, 0])
            _draw_cut(cut, pictures[name], 1)
            ends = pictures[name]["ends"]
            cut.plot(ends[:, 0], ends[:, 2], color=COLOURS[3], linewidth=2.5)
            cut.set_title(f"{name}, cut at y = {ends[0, 1]:g}")
            along = row.add_subplot(layout[0, 1])
            along.plot(found["place"], found["d"], color=QUIET, linewidth=4, alpha=0.5, label="true distance")
            along.plot(found["place"], found["u"], color=ACCENT, label="u")
            nearest = found["nearest"]
            along.plot(found["place"], nearest, color=COLOURS[1], linestyle=":", label="nearest sample")
            along.legend(loc="upper center", ncols=3)
            along.set(ylabel="distance", ylim=(0, 1.25 * np.max(found["d"])))
            error = row.add_subplot(layout[1, 1], sharex=along)
            error.plot(found["place"], 1e3 * (np.array(found["u"]) - found["d"]), color=ACCENT)
            error.set(xlabel="place on the line", ylabel="(u − d) × 1000")
        _save(figure, path)


def plot_offsets(path: Path, picture: dict, up: int) -> None:
    """A cut with iso-lines of u over those of d, and the level sets cut open; see `field_offsets.offsets`. `up` is the
    axis that is drawn upwards."""
    with plt.rc_context(STYLE):
        figure, (cut, shells) = plt.subplots(1, 2, figsize=(10, 4.6), layout="constrained")
        _draw_cut(cut, picture, picture["axis"], up)
        cut.set_title("u (dark) over d (orange), every 0.02")
        shells.imshow(_opened(picture, up), interpolation="lanczos")
        shells.set_title("level sets 0 to 0.1, cut open")
        shells.set_axis_off()
        _save(figure, path)


def plot_density_cuts(path: Path, found: dict, nodes: np.ndarray, axis: int, up: int, counts) -> None:
    """The same cut of the truth, of the field without diffusion and of ours, for several numbers of points."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 1 + len(counts), figsize=(10, 5.2), layout="constrained")
        shape = nodes.shape[:2]
        titles = {"projection": "without diffusion", "ours": "with diffusion"}
        for row, (way, title) in zip(axes, titles.items(), strict=True):
            shown = [("truth", found["truth"]), *zip((f"{n:,} points" for n in counts), found[way], strict=True)]
            for panel, (name, u) in zip(row, shown, strict=True):
                _draw_cut(panel, {"nodes": nodes, "u": np.reshape(u, shape)}, axis, up)
                panel.set_title(name if name == "truth" else f"{title},\n{name}", fontsize=9)
        _save(figure, path)


def plot_densities(path: Path, rows: list[dict], titles: dict[str, str]) -> None:
    """Error at nodes near the surface over the number of points, for each shape."""
    shapes = list(dict.fromkeys(row["case"] for row in rows))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, len(shapes), figsize=(10, 4), layout="constrained", sharey=True)
        for panel, shape in zip(axes, shapes, strict=True):
            of_shape = [row for row in rows if row["case"] == shape]
            for colour, (way, title) in zip(_WAYS, titles.items(), strict=True):
                errors = [row[way]["nodes"] for row in of_shape]
                panel.plot([row["points"] for row in of_shape], errors, marker="o", label=title, color=colour)
            panel.set(xscale="log", yscale="log", xlabel="points", title=shape)
        axes[0].set_ylabel("mean |u − d| × 1000 at nodes")
        axes[-1].legend()
        _save(figure, path)


def _draw_cut(panel, picture, axis, up=2):
    """u as colour with iso-lines STEP apart, and those of d over them where the picture has d."""
    across = ({0, 1, 2} - {axis, up}).pop()
    u, d = (np.asarray(picture[key]) if key in picture else None for key in ("u", "d"))
    nodes = picture["nodes"]
    if across > up:
        nodes, u, d = (None if a is None else a.swapaxes(0, 1) for a in (nodes, u, d))
    x, y = nodes[:, 0, across], nodes[0, :, up]
    extent = (x[0], x[-1], y[0], y[-1])
    panel.imshow(u.T, cmap=DISTANCES, vmin=0, origin="lower", extent=extent, interpolation="bilinear")
    levels = np.arange(STEP, u.max(), STEP)
    if d is not None:
        panel.contour(x, y, d.T, levels, colors=ACCENT, linewidths=1.6, alpha=0.8)
    panel.contour(x, y, u.T, levels, colors=INK, linewidths=0.6)
    panel.set_axis_off()


def _opened(picture, up):
    """The level sets on the far side of the cut, seen from this side and a little from above, darker with the level."""
    axis = picture["axis"]
    towards = np.where(np.arange(3) == axis, _VIEW, np.where(np.arange(3) == up, 1 - _VIEW, 0.15))
    parts = []
    for level, mesh in picture["meshes"].items():
        behind = (mesh.vertices[:, axis] < picture["place"])[mesh.faces].all(axis=1)
        colour = matplotlib.colors.to_rgb(ACCENT) if level == 0 else DISTANCES(0.1 + 8 * level)[:3]
        facing = np.abs(vertex_normals(mesh.vertices, mesh.faces) @ towards) / np.linalg.norm(towards)
        parts.append((mesh.vertices, mesh.faces[behind], (0.35 + 0.65 * facing)[:, None] * colour))
    starts = np.cumsum([0, *(len(vertices) for vertices, _, _ in parts)])
    vertices, colours = (np.concatenate([part[k] for part in parts]) for k in (0, 2))
    faces = np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=False)])
    camera = Camera.facing(vertices[np.unique(faces)], towards, np.eye(3)[up], _IMAGE)
    return render(vertices, faces, colours, camera, cull=False)


def _save(figure, path):
    """As a PNG of few colours, which is a third of the size."""
    drawn = BytesIO()
    figure.savefig(drawn, dpi=_DPI)
    plt.close(figure)
    with atomic_path(path) as temporary:
        Image.open(drawn).convert("RGB").quantize(_COLOURS_KEPT, dither=Image.Dither.NONE).save(
            temporary, format="PNG", optimize=True
        )
