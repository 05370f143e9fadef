"""One side of a double cover, by closed form."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import ConvexHull, KDTree

from core import Mesh
from core.field.grid import Grid
from core.surface.single.one_side import one_side
from tests import shapes

CELL = 0.1
GRID = Grid(np.full(3, -1.55), CELL, (32, 32, 32))
SURFACE = SimpleNamespace(tree=KDTree(shapes.sphere(1500)))


def cover():
    """Both sides of a ball: the faces of the outer one, then those of the inner one."""
    x = shapes.sphere(1500)
    faces = ConvexHull(x).simplices
    a, b, c = np.moveaxis(x[faces], 1, 0)
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inwards] = faces[inwards, ::-1]
    return Mesh(np.concatenate([1.001 * x, 0.999 * x]), np.concatenate([faces, faces[:, ::-1] + 1500]).astype(np.int32))


def distances(sign=1.0, wrong=0.0):
    """From the ball, positive outside for the sign 1; a share of them has the wrong sign."""
    nodes = GRID.positions(np.arange(np.prod(GRID.shape)))
    signed = np.linalg.norm(nodes, axis=1).reshape(GRID.shape) - 1
    turned = np.random.default_rng(0).random(GRID.shape) < wrong
    return (sign * np.where(turned, -signed, signed)).astype(np.float32)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_larger_side_is_taken_whichever_way_signs_go(sign):
    found = one_side(cover(), distances(sign), SURFACE, GRID)
    np.testing.assert_allclose(np.linalg.norm(found.vertices, axis=1), 1.001)
    assert shapes.euler(found) == 2


def test_a_few_nodes_with_the_wrong_sign_change_nothing():
    found = one_side(cover(), distances(wrong=0.03), SURFACE, GRID)
    np.testing.assert_allclose(np.linalg.norm(found.vertices, axis=1), 1.001)
    assert shapes.euler(found) == 2
