import bpy

settings = bpy.context.scene.vad
for name in ("resolution", "band", "bridge", "offset", "denoise", "outliers"):
    settings.property_unset(name)
settings.resolution = 256
settings.offset = 0.7
settings.denoise = "0"
