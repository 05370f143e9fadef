"""What is registered while SciPy is missing: the same tab and operator, both saying what to do."""

import bpy

from .message import draw_message
from .requirements import scipy_problem


class VAD_OT_reconstruct(bpy.types.Operator):
    bl_idname = "vad.reconstruct"
    bl_label = "Reconstruct"
    bl_description = "Unavailable: SciPy is missing"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set(scipy_problem())
        return False


class VAD_PT_reconstruct(bpy.types.Panel):
    bl_label = "VAD Surface Reconstruction"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "VAD"

    problem = ""

    def draw(self, context):
        draw_message(self.layout, self.problem, "ERROR")
        self.layout.operator(VAD_OT_reconstruct.bl_idname)


def register():
    VAD_PT_reconstruct.problem = scipy_problem()
    bpy.utils.register_class(VAD_OT_reconstruct)
    bpy.utils.register_class(VAD_PT_reconstruct)


def unregister():
    bpy.utils.unregister_class(VAD_PT_reconstruct)
    bpy.utils.unregister_class(VAD_OT_reconstruct)
