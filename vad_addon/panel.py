"""The sidebar tab "VAD" of the 3D viewport."""

import bpy

from ..core.settings import options
from .delivery import summary, warnings
from .message import draw_message
from .operators import VAD_OT_reconstruct
from .points_in import point_count, selection_problem

MAIN_SETTINGS = ("resolution", "bridge", "offset")


class _Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "VAD"


class VAD_PT_reconstruct(_Sidebar, bpy.types.Panel):
    bl_label = "VAD Surface Reconstruction"

    def draw(self, context):
        layout = self.layout
        obj = context.active_object
        if problem := selection_problem(obj):
            draw_message(layout, problem, "INFO")
        else:
            layout.label(text=f"{obj.name}: {point_count(obj, context):,} points", icon=f"OUTLINER_OB_{obj.type}")
        _settings_column(layout, context.scene.vad, MAIN_SETTINGS)
        layout.operator(VAD_OT_reconstruct.bl_idname, icon="OUTLINER_OB_MESH")


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
        return context.scene.vad.result is not None

    def draw(self, context):
        result = context.scene.vad.result
        lines = self.layout.column(align=True)
        lines.label(text=result.name, icon="OUTLINER_COLLECTION")
        for line in summary(result):
            lines.label(text=line, icon="BLANK1")
        for warning in warnings(result):
            draw_message(self.layout, warning, "ERROR")


def _settings_column(layout, scene_settings, names):
    layout.use_property_split = True
    layout.use_property_decorate = False
    column = layout.column()
    for name in names:
        column.prop(scene_settings, name)
