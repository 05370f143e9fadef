"""Where planes meet, in least squares (the quadric error function of dual contouring)."""

import numpy as np

from ...linalg import row_dots, solve_positive
from ...lookup import sums_of_each


def to_planes(vertices, corner, place, normal, stiffness: float) -> np.ndarray:
    """Steps (v,3) from vertices (v,3) to where their planes meet, in least squares; zero without planes.

    corner    : (c,) int, the vertex that each plane belongs to     place, normal : (c,3), a point of it and its normal
    stiffness : of vertices against moving along what their planes leave open, beside 1 of a plane
    """
    offset = row_dots(normal, place - vertices[corner])
    matrix = np.zeros((len(vertices), 3, 3))
    right = sums_of_each(corner, normal * offset[:, None], len(vertices))
    for a in range(3):
        for b in range(3):
            matrix[:, a, b] = np.bincount(corner, normal[:, a] * normal[:, b], len(vertices))
    weight = np.maximum(np.bincount(corner, minlength=len(vertices)), 1)
    return solve_positive(matrix + stiffness * weight[:, None, None] * np.eye(3), right)
