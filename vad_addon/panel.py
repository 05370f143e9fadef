"""The sidebar tab "VAD" of the 3D viewport."""

import bpy

from ..core.settings import options
from . import cost, extras, job, results, shapes, stages, status
from .message import draw_message
from .operators import VAD_OT_cancel, VAD_OT_reconstruct
from .points_in import missing, point_count, selection_problem, sources
from .presets import VAD_PT_presets

MAIN_SETTINGS = ("resolution", "bridge", "offset")
MATTERS_WITH = {  # greyed out unless another setting has this value
    "backend": ("solver", "energy"),
    "device": ("solver", "energy"),
    "diffusion": ("integration", "poisson"),
}


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "VAD"


class VAD_PT_reconstruct(_Sidebar, bpy.types.Panel):
    bl_label = "VAD Surface Reconstruction"

    def draw_header_preset(self, context):
        VAD_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        layout, stored = self.layout, context.scene.vad
        if running := job.running():
            _draw_progress(layout, running)
            return
        objects = sources(context)
        if problem := results.scene_problem(context.scene) or selection_problem(context):
            draw_message(layout, problem, "INFO")
        else:
            name = objects[0].name if len(objects) == 1 else f"{len(objects)} objects"
            icon = f"OUTLINER_OB_{objects[0].type}"
            layout.label(text=f"{name}: {point_count(objects, context):,} points", icon=icon)
        if lost := missing(context):
            draw_message(layout, lost, "ERROR")
        extra = ["selected_only"] if any(obj.mode == "EDIT" for obj in objects) else []
        again = results.previous(context.scene, objects)
        _settings_column(layout, stored, [*extra, *MAIN_SETTINGS, *(["keep_both"] if again else [])])
        row = layout.row()
        row.scale_y = 1.5
        row.operator(VAD_OT_reconstruct.bl_idname, icon="OUTLINER_OB_MESH")
        row = layout.row(align=True)
        row.operator(stages.VAD_OT_denoise.bl_idname, icon="SMOOTHCURVE")
        row.operator(stages.VAD_OT_normals.bl_idname, icon="NORMALS_FACE")
        layout.operator(cost.VAD_OT_estimate.bl_idname, icon="QUESTION")
        if told := cost.lines(context):
            column = layout.column(align=True)
            for line in told:
                draw_message(column, line, "BLANK1")
            column.operator(cost.VAD_OT_use_resolution.bl_idname, text=f"Use Resolution {cost.suits()}")


class VAD_PT_more_settings(_Sidebar, bpy.types.Panel):
    bl_label = "More Settings"
    bl_parent_id = "VAD_PT_reconstruct"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        _settings_column(self.layout, context.scene.vad, [name for name in options() if name not in MAIN_SETTINGS])


class VAD_PT_last_run(_Sidebar, bpy.types.Panel):
    bl_label = "Last Run"
    bl_parent_id = "VAD_PT_reconstruct"

    @classmethod
    def poll(cls, context):
        return extras.chosen_result(context) is not None

    def draw(self, context):
        result = extras.chosen_result(context)
        lines = self.layout.column(align=True)
        lines.label(text=result.name, icon="OUTLINER_COLLECTION")
        for line in results.summary(result):
            lines.label(text=line, icon="BLANK1")
        for warning in results.warnings(result):
            draw_message(self.layout, warning[:1].upper() + warning[1:], "ERROR")


class VAD_PT_look(_Sidebar, bpy.types.Panel):
    bl_label = "Look Closer"
    bl_parent_id = "VAD_PT_reconstruct"

    @classmethod
    def poll(cls, context):
        return extras.chosen_result(context) is not None

    def draw(self, context):
        collection, layer = extras.chosen_result(context), context.view_layer
        self.layout.label(text=collection.name, icon="OUTLINER_COLLECTION")
        row = self.layout.row(align=True)
        for role, name, _ in results.SHOWN:
            objects = [obj for obj in results.shown_as(collection, role) if results.is_among(obj, layer.objects)]
            if objects:
                shown = all(obj.visible_get() for obj in objects)
                row.operator(extras.VAD_OT_show.bl_idname, text=name, depress=shown).role = role
        self.layout.operator(stages.VAD_OT_reextract.bl_idname, icon="FILE_REFRESH")
        column = self.layout.column(align=True)
        column.operator(extras.VAD_OT_shell.bl_idname, icon="MOD_SOLIDIFY")
        column.operator(extras.VAD_OT_slice.bl_idname, icon="MOD_BOOLEAN")
        column.operator(extras.VAD_OT_normals_to_geometry.bl_idname, icon="CURVES_DATA")
        obj = context.active_object
        for modifier in obj.modifiers if obj else ():
            if modifier.type == "VOLUME_TO_MESH" and results.role(obj) == shapes.SHELL:
                self.layout.prop(modifier, "threshold", text="Distance")


class VAD_PT_overlay(_Sidebar, bpy.types.Panel):
    bl_label = "Show Normals"
    bl_parent_id = "VAD_PT_reconstruct"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.vad.overlay, "show", text="")

    def draw(self, context):
        style = context.scene.vad.overlay
        names = ["colour_by", *(["colour"] if style.colour_by == "SINGLE" else [])]
        _settings_column(self.layout, style, [*names, "fixed_colour", "length", "width", "every", "maximum"])


class VAD_PT_axes(_Sidebar, bpy.types.Panel):
    bl_label = "Fix Normals by Hand"
    bl_parent_id = "VAD_PT_reconstruct"

    @classmethod
    def poll(cls, context):
        return context.mode == "EDIT_MESH"

    def draw(self, context):
        column = self.layout.column(align=True)
        for item in bpy.ops.vad.fix_axes.get_rna_type().properties["origin"].enum_items:
            column.operator(extras.VAD_OT_fix_axes.bl_idname, text=f"From {item.name}").origin = item.identifier
        self.layout.operator(extras.VAD_OT_free_axes.bl_idname)


CLASSES = (
    VAD_PT_reconstruct,
    VAD_PT_more_settings,
    VAD_PT_last_run,
    VAD_PT_look,
    VAD_PT_overlay,
    VAD_PT_axes,
)


def _draw_progress(layout, running):
    layout.progress(factor=running.fraction, text=f"{running.fraction:.0%}")
    layout.label(text=status.line(running), icon="TIME")
    layout.operator(VAD_OT_cancel.bl_idname, icon="CANCEL")


def _settings_column(layout, scene_settings, names):
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    for name in names:
        row = column.row()
        other, value = MATTERS_WITH.get(name, (name, None))
        row.active = value is None or getattr(scene_settings, other) == value
        row.prop(scene_settings, name)
