"""Where planes meet."""

import numpy as np

from core.surface.meshing.planes import to_planes

STIFFNESS = 0.02


def test_vertices_go_to_corners_along_creases_no_further_than_they_must_and_stay_without_planes(random):
    corner_at, start = random.normal(size=(2, 3))
    turned = np.linalg.qr(random.normal(size=(3, 3)))[0]
    belongs = np.array([0, 0, 0, 2, 2])
    normal = turned[[0, 1, 2, 0, 1]]
    place = corner_at + np.cross(normal, random.normal(size=(5, 3)))
    vertices = np.stack([start] * 3)
    step = to_planes(vertices, belongs, place, normal, STIFFNESS)
    np.testing.assert_array_equal(step[1], 0)
    away = turned @ (corner_at - start)
    np.testing.assert_allclose(turned @ step[0], away / (1 + 3 * STIFFNESS))
    np.testing.assert_allclose(turned @ step[2], away * [1, 1, 0] / (1 + 2 * STIFFNESS), atol=1e-12)
