"""The extension's entry point; Blender is imported only when it registers, so that tests run without it."""


def register():
    from . import vad_addon

    vad_addon.register()


def unregister():
    from . import vad_addon

    vad_addon.unregister()
