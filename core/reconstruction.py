"""What a run returns."""

from dataclasses import dataclass

import numpy as np

from .field.distance_field import BandedField, DistanceField
from .surface.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Everything a run found, in the input's units.

    points       : (n',3) float64 samples used
    source_index : (n',) int64, row of each sample in the input, ascending
    normals      : (n',3) float64 unit axes; the sign carries no meaning
    confidence   : (n',) float64 in [0,1], how well the neighbours agree on the axis
    field        : DistanceField, or BandedField where the setting `band` is given; signed where `surface` is "signed"
    surface      : Mesh, closed: the double cover, or where the setting `surface` is "signed" the boundary of the
                   inside, wound outwards; None where it is "single" or "none"
    sheet        : Mesh, the single layer, where the setting `surface` is "single" or "both"; else None
    report       : dict, JSON-ready: settings, counts, seconds per stage, peak memory, warnings
    """

    points: np.ndarray
    source_index: np.ndarray
    normals: np.ndarray
    confidence: np.ndarray
    field: DistanceField | BandedField
    surface: Mesh | None
    sheet: Mesh | None
    report: dict
