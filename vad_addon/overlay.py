"""Normals drawn over the viewport: two-sided lines through the samples, as an axis has no front.

Nothing is installed and nothing costs time while no scene shows them.
"""

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader

from . import axes, points_in, results

_handle = None
_batches = {}  # by object and everything the drawing depends on


class VAD_PG_overlay(bpy.types.PropertyGroup):
    """How the normals are shown."""

    def _changed(self, context):
        sync()

    show: bpy.props.BoolProperty(
        name="Normals", description="Draw the normals of the samples as lines over the viewport", update=_changed
    )
    length: bpy.props.FloatProperty(
        name="Length",
        description="Length of a line, in units of a sample's size (a quarter of a grid cell; of normals found alone, "
        "of the points' spacing)",
        default=6.0,
        min=0.1,
        max=1000.0,
        soft_max=40.0,
        update=_changed,
    )
    width: bpy.props.FloatProperty(
        name="Width", description="Width of a line in pixels", default=1.5, min=1.0, max=20.0, soft_max=5.0
    )
    colour_by: bpy.props.EnumProperty(
        name="Color",
        description="What colors the lines",
        items=[
            ("SINGLE", "Single", "The color chosen below"),
            ("DIRECTION", "Direction", "Red, green and blue for the x, y and z part of the axis"),
            ("CONFIDENCE", "Confidence", "From red, where the neighbours disagree on the axis, to green"),
        ],
        update=_changed,
    )
    colour: bpy.props.FloatVectorProperty(
        name="Line Color",
        description="Color of the lines",
        subtype="COLOR_GAMMA",
        size=4,
        min=0.0,
        max=1.0,
        default=(0.1, 0.9, 1.0, 1.0),
        update=_changed,
    )
    fixed_colour: bpy.props.FloatVectorProperty(
        name="Fixed Axes",
        description="Color of the axes that are fixed by hand",
        subtype="COLOR_GAMMA",
        size=4,
        min=0.0,
        max=1.0,
        default=(1.0, 0.2, 0.9, 1.0),
        update=_changed,
    )
    every: bpy.props.IntProperty(
        name="Every", description="Draw only every n-th sample", default=1, min=1, max=1_000_000, update=_changed
    )
    maximum: bpy.props.IntProperty(
        name="At Most",
        description="Draw no more lines than this per object, spread evenly over the samples",
        default=50_000,
        min=1,
        max=10_000_000,
        update=_changed,
    )


def sync() -> None:
    """Install or remove the drawing, as the scenes ask, and draw anew."""
    global _handle
    _batches.clear()
    wanted = any(scene.vad.overlay.show for scene in bpy.data.scenes)
    if wanted and _handle is None:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
        bpy.app.handlers.depsgraph_update_post.append(_geometry_changed)
    elif not wanted:
        remove()
    _redraw()


def remove() -> None:
    """Take the drawing away."""
    global _handle
    _batches.clear()
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
        if _geometry_changed in bpy.app.handlers.depsgraph_update_post:  # scripts may have cleared them
            bpy.app.handlers.depsgraph_update_post.remove(_geometry_changed)
        _redraw()


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@persistent
def on_new_data(*_):
    """After a file was loaded or a step undone: other scenes, other objects."""
    sync()


@persistent
def _geometry_changed(scene, depsgraph):
    changed = {update.id.name for update in depsgraph.updates if update.is_updated_geometry}
    for key in [key for key in _batches if key[0] in changed]:
        del _batches[key]


def segments(points, normals, reach, every: int, maximum: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the lines, (2k,3) float32, and the samples they belong to, (k,): every n-th, thinned out to the maximum.

    points, normals : (n,3)     reach : (n,) or scalar, half a line's length
    """
    rows = np.arange(0, len(points), every)
    if len(rows) > maximum:
        rows = rows[np.linspace(0, len(rows) - 1, maximum).astype(int)]
    half = np.broadcast_to(np.asarray(reach)[..., None], (len(points), 1))[rows] * normals[rows]
    ends = np.stack([points[rows] - half, points[rows] + half], axis=1)
    return ends.reshape(-1, 3).astype(np.float32), rows


def colours(style, normals, confidence) -> np.ndarray:
    """(n,4) float32 colour of each sample."""
    result = np.ones((len(normals), 4), np.float32)
    if style.colour_by == "DIRECTION":
        result[:, :3] = np.abs(normals)
    elif style.colour_by == "CONFIDENCE":
        red, green = np.array((0.9, 0.1, 0.1)), np.array((0.1, 0.9, 0.2))
        result[:, :3] = red + np.clip(confidence, 0, 1)[:, None] * (green - red)
    else:
        result[:] = style.colour
    return result


def _draw():
    context = bpy.context
    style = context.scene.vad.overlay
    if not style.show or not context.space_data.overlay.show_overlays:
        return
    shader = gpu.shader.from_builtin("POLYLINE_FLAT_COLOR")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    shader.bind()
    shader.uniform_float("viewportSize", (context.region.width, context.region.height))
    shader.uniform_float("lineWidth", style.width)
    try:
        for obj in _shown(context.visible_objects):
            for batch in _batches_of(obj, style, shader):
                with gpu.matrix.push_pop():
                    gpu.matrix.multiply_matrix(obj.matrix_world)
                    batch.draw(shader)
    finally:
        gpu.state.blend_set("NONE")
        gpu.state.depth_test_set("NONE")


def _shown(visible):
    """The visible objects, and the samples of each run of which anything is visible: they may be hidden themselves."""
    held = results.held()
    runs = {held.get(obj) or results.run_of(obj) for obj in visible if results.role(obj)} - {None}
    samples = filter(None, (results.member(run, results.SAMPLES) for run in runs))
    return {*visible, *samples}


def _batches_of(obj, style, shader):
    if results.role(obj) in {results.SAMPLES, results.ESTIMATE} and obj.type == "POINTCLOUD":
        make = _normal_lines
    elif axes.held_by(obj):
        make = _fixed_lines
    else:
        return
    key = obj.data.name, obj.data.session_uid, points_in.in_edit_mode(obj)
    if key not in _batches:
        lines = make(obj, style)
        content = {"pos": lines[0], "color": np.repeat(lines[1], 2, axis=0)}
        _batches[key] = batch_for_shader(shader, "LINES", content) if len(lines[0]) else None
    if _batches[key] is not None:
        yield _batches[key]


def _normal_lines(obj, style):
    points, normals, confidence, radius = samples_of(obj.data)
    ends, rows = segments(points, normals, 0.5 * style.length * radius, style.every, style.maximum)
    return ends, colours(style, normals[rows], confidence[rows])


def _fixed_lines(obj, style):
    points, fixed = axes.read(obj)
    size = np.ptp(points, axis=0).max() if len(points) else 0.0
    ends, rows = segments(points, fixed, 0.03 * size, 1, style.maximum)
    return ends, np.tile(np.float32(style.fixed_colour), (len(rows), 1))


def samples_of(cloud: bpy.types.PointCloud) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(n,3) points and normals, (n,) confidence and radius of a result's samples; zeros for what the user removed."""

    def values(name, slot, width):
        flat = np.zeros(width * cloud.attributes.domain_size("POINT"), np.float32)
        if name in cloud.attributes:
            cloud.attributes[name].data.foreach_get(slot, flat)
        return flat

    points, normals = (values(name, "vector", 3).reshape(-1, 3) for name in ("position", "normal"))
    return points, normals, values("confidence", "value", 1), values("radius", "value", 1)
