"""Registration of everything Blender shows."""

import bpy

from . import operators, panel, properties

CLASSES = (
    properties.VAD_PG_scene,
    operators.VAD_OT_reconstruct,
    panel.VAD_PT_reconstruct,
    panel.VAD_PT_more_settings,
    panel.VAD_PT_last_run,
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.vad = bpy.props.PointerProperty(type=properties.VAD_PG_scene)


def unregister():
    del bpy.types.Scene.vad
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
