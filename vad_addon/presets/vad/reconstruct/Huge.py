import bpy

settings = bpy.context.scene.vad
for name in ("resolution", "band", "bridge", "offset", "denoise", "outliers"):
    settings.property_unset(name)
settings.resolution = 512
settings.band = "4"
settings.bridge = 4.0
