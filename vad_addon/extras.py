"""Operators that are instant: shapes that follow a result, and axes fixed by hand. Their redo panels are live."""

import bpy
import numpy as np
from mathutils import Vector

from ..core.errors import InputError, VADError
from . import axes, points_in, results, shapes, volume_files


def chosen_result(context: bpy.types.Context) -> bpy.types.Collection | None:
    """The run whose results are meant: the one that the active object is a result of, or whose collection it is in if
    it holds no points; else one of what is selected, else one that this was joined for. The scene's last where nothing
    that can be read is active."""
    obj = points_in.active_object(context)
    if obj is None:
        return context.scene.vad.result
    is_scan = obj.type in points_in.READABLE and (results.role(obj) is None or results.is_copy(obj))
    found = (None if is_scan else results.run_of(obj)) or results.previous(context.scene, points_in.sources(context))
    if found is not None or obj.type in points_in.READABLE:
        return found or results.joined(context.scene, obj)
    return context.scene.vad.result


def no_results(context: bpy.types.Context) -> str:
    """What to say where :func:`chosen_result` finds none."""
    obj = points_in.active_object(context)
    if obj is None or context.scene.vad.result is None:
        return "There are no results yet: reconstruct first"
    return f"{obj.name} has no results yet: reconstruct it first, or select results"


def _adding_problem(context):
    """Why nothing can be added to the results that are meant, one line; empty where it can."""
    collection = chosen_result(context)
    if collection is None:
        return no_results(context)
    if not results.is_editable(collection):
        return f"{collection.name} is linked from another file: make it local"
    if not results.is_in(collection, context.view_layer):
        return f"{collection.name} is not in this view layer, or excluded from it: include it in the outliner"
    return ""


class _OfResult:
    """An operator that adds an object to the results of a run and makes it the active one."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        problem = _adding_problem(context)
        cls.poll_message_set(problem)
        return not problem

    def execute(self, context):
        try:
            obj = self.make(chosen_result(context))
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        results.leave_modes(context)
        for other in context.selected_objects:
            other.select_set(False)
        context.view_layer.objects.active = obj
        obj.select_set(True)
        return {"FINISHED"}


class VAD_OT_shell(_OfResult, bpy.types.Operator):
    """Add a closed mesh at some distance from the surface, on both sides of it, of a signed field outside alone; in a
    band, less than its width away. It follows the volume; its modifier's threshold changes the distance at once"""

    bl_idname = "vad.shell"
    bl_label = "Offset Surface"

    offset: bpy.props.FloatProperty(
        name="Offset", description="Distance from the surface. Unit: grid cells", default=1.5, min=0.5, soft_max=20.0
    )

    def make(self, collection):
        return shapes.shell(collection, self.offset)

    def execute(self, context):
        done = super().execute(context)
        if done == {"FINISHED"}:
            shell = context.view_layer.objects.active
            if not len(shell.evaluated_get(context.evaluated_depsgraph_get()).data.polygons):
                self.report({"WARNING"}, f"{shell.name} is empty: no distance in the volume is {self.offset:.3g} cells")
        return done


class VAD_OT_slice(_OfResult, bpy.types.Operator):
    """Add a plane that shows the distances where it lies, with iso-lines. Move and turn it to look around"""

    bl_idname = "vad.slice"
    bl_label = "Slice"

    axis: bpy.props.EnumProperty(
        name="Across",
        description="Axis that the plane cuts across",
        items=[(name, name, f"Cut across the {name} axis") for name in "XYZ"],
        default="Y",
    )

    def make(self, collection):
        return shapes.cut(collection, "XYZ".index(self.axis))

    def invoke(self, context, event):
        shading = getattr(context.space_data, "shading", None)
        if shading is not None and shading.type in {"SOLID", "WIREFRAME"}:
            shading.type = "MATERIAL"  # the others show no colours
        return self.execute(context)


class VAD_OT_normals_to_geometry(_OfResult, bpy.types.Operator):
    """Add the normals as curves, which render, unlike the overlay"""

    bl_idname = "vad.normals_to_geometry"
    bl_label = "Normals to Geometry"

    length: bpy.props.FloatProperty(
        name="Length", description="Length of a line. Unit: sizes of a sample", default=6.0, min=0.1, soft_max=40.0
    )
    thickness: bpy.props.FloatProperty(
        name="Thickness",
        description="Thickness of a line. Unit: sizes of a sample",
        default=0.3,
        min=0.01,
        soft_max=2.0,
    )
    every: bpy.props.IntProperty(name="Every", description="Take only every n-th sample", default=1, min=1)

    def invoke(self, context, event):
        overlay = context.scene.vad.overlay
        self.length, self.every = overlay.length, overlay.every
        return self.execute(context)

    def make(self, collection):
        return shapes.normals(collection, self.length, self.thickness, self.every)


class VAD_OT_show(bpy.types.Operator):
    """Show or hide this, in the viewport and in renders"""

    bl_idname = "vad.show"
    bl_label = "Show"
    bl_options = {"UNDO"}

    role: bpy.props.EnumProperty(
        name="What",
        description="Which of the results",
        items=[(role, name, f"Show or hide {text}") for role, name, text in results.SHOWN],
    )

    @classmethod
    def poll(cls, context):
        cls.poll_message_set(no_results(context))
        return chosen_result(context) is not None

    @classmethod
    def description(cls, context, properties):
        return f"Show or hide {_in_words(properties.role)}"

    def execute(self, context):
        collection, there = chosen_result(context), context.scene.objects
        objects = [obj for obj in results.shown_as(collection, self.role) if results.is_among(obj, there)]
        if not objects:
            why = "deleted" if self.role == "source" else "deleted, or not asked for"
            self.report({"ERROR"}, f"{collection.name} has nothing to show for {_in_words(self.role)}: it was {why}")
            return {"CANCELLED"}
        shown = not all(obj.visible_get() for obj in objects)
        for obj in objects:
            results.show(context.scene, obj, shown)
        for obj in objects:
            if problem := results.unseen(obj) or (shown and _without_file(obj)):
                self.report({"WARNING"}, problem)
            if obj.library is not None:
                self.report({"WARNING"}, f"{obj.name} is linked: whether renders show it is set in its own file")
        return {"FINISHED"}


def _in_words(role):
    """What is shown and hidden by this name."""
    return next(text for name, _, text in results.SHOWN if name == role)


def _without_file(obj):
    """What to say of a field that shows nothing, as its file is gone; empty of any other object."""
    if obj.type != "VOLUME" or obj.data.packed_file is not None or volume_files.file_of(obj.data).is_file():
        return ""
    return shapes.unreadable(obj)


class _OfEditedMesh:
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Enter edit mode of a mesh and select the points whose axis you know")
        return context.mode == "EDIT_MESH"

    def execute(self, context):
        try:
            chosen = {obj: axes.selected(obj) for obj in context.objects_in_mode_unique_data}
            count = sum(map(len, chosen.values()))
            if not count:
                raise InputError("0 points are selected: select those whose axis you know")
            wanted = {obj: self.axes(context, obj, points) for obj, points in chosen.items() if len(points)}
            for obj, found in wanted.items():
                axes.fix(obj, found)
        except VADError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{count:,} points {self.done}")
        return {"FINISHED"}


class VAD_OT_fix_axes(_OfEditedMesh, bpy.types.Operator):
    """Fix the normal's axis at the selected points; the next run holds to it"""

    bl_idname = "vad.fix_axes"
    bl_label = "Fix Axes"
    done = "fixed"

    origin: bpy.props.EnumProperty(
        name="From",
        description="Where the axis comes from",
        items=[
            ("VIEW", "View", "The direction you look in"),
            (
                "ACTIVE",
                "Active Element",
                "Normal of the active face, direction of the active edge, axis fixed at the vertex",
            ),
            ("CURSOR", "3D Cursor", "From each point towards the 3D cursor"),
            ("TYPED", "Typed Values", "The axis typed below"),
        ],
    )
    axis: bpy.props.FloatVectorProperty(
        name="Axis", description="The axis, in world space; its sign and length do not matter", default=(0, 0, 1)
    )

    def execute(self, context):
        done = super().execute(context)
        if done == {"FINISHED"} and not bpy.app.background:
            context.scene.vad.overlay.show = True  # to see them
        return done

    def draw(self, context):
        self.layout.prop(self, "origin")
        if self.origin == "TYPED":
            self.layout.prop(self, "axis")

    def axes(self, context, obj, points):
        if self.origin == "ACTIVE":
            world = axes.of_active(context.active_object)
        elif self.origin == "CURSOR":
            here = points_in.in_world(points, obj)
            world = np.array(context.scene.cursor.location) - here
            if np.linalg.norm(world, axis=1).min() <= 1e-6 * np.abs(here).max():  # single precision
                raise InputError("The 3D cursor lies on a selected point: move it, or deselect that point")
        elif self.origin == "VIEW":
            if context.region_data is None:
                raise InputError("No view to take the axis from: run this in a 3D viewport, or type the axis")
            world = np.array(context.region_data.view_rotation @ Vector((0, 0, 1)))
        else:
            world = np.array(self.axis)
        length = np.linalg.norm(world, axis=-1)
        if not ((length > 0) & (length < np.inf)).all():
            raise InputError(f"An axis of length {np.min(length):g} has no direction: give another one")
        matrix = np.array(obj.matrix_world, np.float64)
        return world @ matrix[:3, :3]  # normals go from world to object space by the transposed matrix


class VAD_OT_free_axes(_OfEditedMesh, bpy.types.Operator):
    """Let the selected points find their normals by themselves again"""

    bl_idname = "vad.free_axes"
    bl_label = "Free Axes"
    done = "freed"

    def axes(self, context, obj, points):
        return np.zeros(3)


CLASSES = VAD_OT_show, VAD_OT_shell, VAD_OT_slice, VAD_OT_normals_to_geometry, VAD_OT_fix_axes, VAD_OT_free_axes
