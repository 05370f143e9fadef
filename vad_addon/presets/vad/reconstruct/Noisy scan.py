import bpy

settings = bpy.context.scene.vad
for name in ("resolution", "band", "bridge", "offset", "denoise", "outliers"):
    settings.property_unset(name)
settings.denoise = "1"
settings.outliers = True
