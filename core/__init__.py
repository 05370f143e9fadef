"""VAD: unsigned distance fields and surfaces from points without normals, by Voronoi-assisted diffusion.

Modules are loaded when a name of theirs is first asked for, so that settings and errors alone need no SciPy.
"""

from importlib import import_module

_PUBLIC = {
    "cleaning.outliers": ("remove_outliers",),
    "cleaning.positions": ("denoise",),
    "errors": ("Cancelled", "InputError", "MemoryBudgetError", "MissingDependency", "SettingsError", "VADError"),
    "field.distance_field": ("BandedField", "DistanceField"),
    "field.grid": ("fit_grid",),
    "field.integration": ("distance_field",),
    "field.local_surface": ("fit_local_surface",),
    "normals.estimate": ("estimate_normals",),
    "pipeline": ("reconstruct",),
    "points": ("local_spacing",),
    "reconstruction": ("Reconstruction",),
    "settings": ("Settings",),
    "surface.attributes": ("vertex_attributes",),
    "surface.double.both_sides": ("both_sides",),
    "surface.double.double_cover": ("double_cover",),
    "surface.edges.crossings": ("find_crossings",),
    "surface.mesh": ("Mesh",),
    "surface.signed": ("signed_distance",),
    "surface.signs.sides": ("find_sides",),
    "surface.single.single_layer": ("single_layer",),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}
__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__():
    return __all__
