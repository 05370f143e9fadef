import bpy

settings = bpy.context.scene.vad
for name in ("resolution", "band", "bridge", "offset", "denoise", "outliers"):
    settings.property_unset(name)
settings.resolution = 96
settings.bridge = 6.0
settings.denoise = "0"
