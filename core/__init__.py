"""VAD: unsigned distance fields and surfaces from points without normals, by Voronoi-assisted diffusion."""

from .errors import Cancelled, InputError, MissingDependency, SettingsError, VADError
from .field.distance_field import BandedField, DistanceField
from .pipeline import reconstruct
from .reconstruction import Reconstruction
from .settings import Settings
from .surface.mesh import Mesh

__all__ = [
    "BandedField",
    "Cancelled",
    "DistanceField",
    "InputError",
    "Mesh",
    "MissingDependency",
    "Reconstruction",
    "Settings",
    "SettingsError",
    "VADError",
    "reconstruct",
]
