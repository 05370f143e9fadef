import bpy

settings = bpy.context.scene.vad
for name in ("resolution", "bridge", "offset", "denoise", "outliers"):
    settings.property_unset(name)
settings.resolution = 320
settings.bridge = 4.0
