"""How well shaped the triangles of a mesh are."""

import numpy as np

from .mesh import Mesh

_SMALL = 5.0  # degrees
_ZERO_AREA = 1e-6  # of the mean face area


def triangle_quality(mesh: Mesh) -> dict:
    """Shape of the triangles; every value None for a mesh without faces.

    min_angle   : mean of the triangles' smallest angles, degrees (60 at best)
    least_angle : the smallest angle of all, degrees
    small_angles : share of triangles with an angle below 5 degrees
    aspect_p95  : 95th percentile of the aspect ratio, the longest side to the height on it, 1 for equilateral ones;
                  None where more than a twentieth have no height
    zero_area   : share of triangles without area
    """
    names = "min_angle", "least_angle", "small_angles", "aspect_p95", "zero_area"
    if not len(mesh.faces):
        return dict.fromkeys(names)
    corners = [mesh.vertices[mesh.faces[:, k]] for k in range(3)]
    squares = [((corners[k] - corners[k - 1]) ** 2).sum(axis=1) for k in range(3)]
    short, middle, long = np.sort(squares, axis=0)
    areas = mesh.face_areas()
    angles = np.degrees(np.arctan2(4 * areas, middle + long - short))
    flatness = 4 / np.sqrt(3) * areas / np.maximum(long, np.finfo(float).tiny)  # one over the aspect ratio
    flattest = np.percentile(flatness, 5, method="lower")
    values = (
        angles.mean(),
        angles.min(),
        (angles < _SMALL).mean(),
        1 / flattest if flattest > 0 else None,
        (areas <= _ZERO_AREA * areas.mean()).mean(),
    )
    return {name: None if value is None else float(value) for name, value in zip(names, values, strict=True)}
