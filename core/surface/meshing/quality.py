"""How well shaped the faces of a mesh are."""

import numpy as np

from ...linalg import cross, dots, lengths
from ..mesh import Mesh, at_corners

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
    corners = at_corners(mesh.vertices, mesh.faces)
    squares = [((corners[k] - corners[k - 1]) ** 2).sum(axis=0) for k in range(3)]
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


def quad_quality(mesh: Mesh) -> dict:
    """Which faces are quads and their shape; the shape None for a mesh without quads.

    quads, triangles  : numbers of faces; a quad's halves count as no triangles here
    quad_angle        : mean of the quads' smallest corner angles, degrees (90 at best)
    quad_aspect_p95   : 95th percentile of the longest side to the shortest, 1 at best; None where more than a twentieth
                        have a side without length
    quad_fold_p95     : 95th percentile of the angle between the planes of a quad's halves, degrees, 0 in a plane
    quad_concave      : share of quads with a corner that points inwards, seen along the mean of their normals
    """
    found = {"quads": mesh.pairs, "triangles": len(mesh.triangles)}
    names = "quad_angle", "quad_aspect_p95", "quad_fold_p95", "quad_concave"
    if not mesh.pairs:
        return found | dict.fromkeys(names)
    places = at_corners(mesh.vertices, mesh.quads)
    ahead = [places[k - 3] - places[k] for k in range(4)]
    turns = [cross(ahead[k - 1], ahead[k]) for k in range(4)]
    angle = [_angle(turns[k], -dots(ahead[k - 1], ahead[k])) for k in range(4)]
    normal = cross(places[2] - places[0], places[3] - places[1])
    sides = np.sort([lengths(side) for side in ahead], axis=0)
    evenness = sides[0] / np.maximum(sides[-1], np.finfo(float).tiny)  # one over the aspect ratio
    least_even = np.percentile(evenness, 5, method="lower")
    fold = _angle(cross(turns[1], turns[3]), dots(turns[1], turns[3]))
    values = (
        np.degrees(np.min(angle, axis=0).mean()),
        1 / least_even if least_even > 0 else None,
        np.percentile(np.degrees(fold), 95),
        np.any([dots(turn, normal) < 0 for turn in turns], axis=0).mean(),
    )
    return found | {name: None if value is None else float(value) for name, value in zip(names, values, strict=True)}


def _angle(product, cosine):
    """Angles (m,) between vectors with cross products (3,m) and inner products (m,); 0 where one has no length."""
    return np.arctan2(lengths(product), cosine + 0.0)  # which leaves no -0, half a turn
