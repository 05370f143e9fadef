"""Registration of everything Blender shows."""

import bpy

from . import (
    cost,
    extras,
    importer,
    operators,
    overlay,
    panel,
    preferences,
    presets,
    properties,
    results,
    run,
    stages,
    volume_files,
)

CLASSES = (
    overlay.VAD_PG_overlay,
    properties.VAD_PG_scene,
    operators.VAD_OT_reconstruct,
    operators.VAD_OT_cancel,
    *stages.CLASSES,
    *cost.CLASSES,
    *extras.CLASSES,
    preferences.VAD_OT_clear_cache,
    preferences.VAD_preferences,
    presets.VAD_OT_add_preset,
    presets.VAD_PT_presets,
    importer.VAD_OT_import_points,
    importer.VAD_FH_points,
    *panel.CLASSES,
)
_HANDLERS = (
    (bpy.app.handlers.load_post, preferences.prepare_scenes),
    (bpy.app.handlers.depsgraph_update_post, preferences.prepare_scenes),
    (bpy.app.handlers.load_post, volume_files.delete_unused),
    (bpy.app.handlers.load_post, overlay.on_new_data),
    (bpy.app.handlers.undo_post, overlay.on_new_data),
    (bpy.app.handlers.redo_post, overlay.on_new_data),
    (bpy.app.handlers.save_pre, results.forget_deleted),
    (bpy.app.handlers.save_pre, volume_files.bring_along),
    (bpy.app.handlers.save_post, volume_files.keep_saved),
    (bpy.app.handlers.save_post_fail, volume_files.put_back),
)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.vad = bpy.props.PointerProperty(type=properties.VAD_PG_scene)
    bpy.types.TOPBAR_MT_file_import.append(importer.draw_menu)
    presets.register()
    for handlers, handler in _HANDLERS:
        handlers.append(handler)
    volume_files.delete_unused_of_module()
    bpy.app.timers.register(overlay.sync)  # scenes that show normals: they cannot be looked at while this runs


def unregister():
    run.shut_down()
    if bpy.app.timers.is_registered(overlay.sync):
        bpy.app.timers.unregister(overlay.sync)
    overlay.remove()
    for handlers, handler in _HANDLERS:
        if handler in handlers:  # scripts may have cleared them
            handlers.remove(handler)
    volume_files.delete_unused_at_exit()
    presets.unregister()
    bpy.types.TOPBAR_MT_file_import.remove(importer.draw_menu)
    del bpy.types.Scene.vad
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
