"""What the vertices of a mesh know: how far off the surface they are, and what the samples beside them carry."""

import numpy as np
from scipy.spatial import KDTree

from ..errors import InputError
from ..given_arrays import attribute_rows
from ..reconstruction import Reconstruction
from .mesh import Mesh

_OWN, _OTHERS = {"distance", "confidence"}, "scan_"


def vertex_attributes(mesh: Mesh, result: Reconstruction, carried: dict | None = None) -> dict[str, np.ndarray]:
    """Values for each vertex of a mesh of this result, by name, (v,) or (v,k).

    distance   : float32, see :func:`residuals`
    confidence : float32 in [0,1], that of the nearest sample
    carried    : what the input's points carry, by name, (n,) or (n,k) of any type, a row for each row of the input. A
                 vertex gets that of its nearest sample, unchanged; what has one of the two names above gets "scan_" put
                 before its own

    Raises :class:`InputError` for carried values with another number of rows than the input, and for no mesh.
    """
    if mesh is None:
        raise InputError("the mesh is None; give the surface or the sheet of a run whose setting `surface` asks for it")
    nearest = nearest_samples(mesh, result)
    at_samples = sample_attributes(result, carried)
    distance = residuals(mesh, result).astype(np.float32)
    return {"distance": distance, **{name: values[nearest] for name, values in at_samples.items()}}


def sample_attributes(result: Reconstruction, carried: dict | None = None) -> dict[str, np.ndarray]:
    """The same for each sample of the result, (n',) or (n',k), but for the distance."""
    count = result.report["counts"]["input"]
    carried = {name: attribute_rows(name, values, count) for name, values in (carried or {}).items()}
    kept = {"confidence": result.confidence.astype(np.float32)}
    for name, values in carried.items():
        while name in _OWN or name in kept:
            name = _OTHERS + name
        kept[name] = values[result.source_index]
    return kept


def nearest_samples(mesh: Mesh, result: Reconstruction) -> np.ndarray:
    """(v,) int64, the row in `result.points` of the sample nearest to each vertex."""
    return KDTree(result.points).query(mesh.vertices, workers=-1)[1]


def residuals(mesh: Mesh, result: Reconstruction) -> np.ndarray:
    """(v,) float64 in input units, how far each vertex is off the surface: the size of the field there."""
    return np.abs(result.field.sample(mesh.vertices))
