"""Faces that pass through others."""

import igl.copyleft.cgal
import numpy as np
import pytest

from core import Mesh, Settings, reconstruct
from core.surface.meshing.untangling import crossing_faces
from tests import shapes


def crossings(mesh):
    """Pairs of faces that cross, told exactly."""
    faces = mesh.faces.astype(np.int64)
    found = igl.copyleft.cgal.remesh_self_intersections(mesh.vertices, faces, detect_only=True)
    return next(np.asarray(each) for each in found if np.ndim(each) == 2 and np.shape(each)[1] == 2)


def soup(seed, size):
    """Triangles with corners of their own, and a few that share one."""
    chance = np.random.default_rng(seed)
    corners = chance.random((60, 1, 3)) + size * chance.normal(size=(60, 3, 3))
    faces = np.arange(180).reshape(60, 3)
    faces[::7, 0] = faces[1::7, 1][: len(faces[::7])]
    return Mesh(corners.reshape(-1, 3), faces.astype(np.int32))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [0.05, 0.2])
def test_pairs_are_those_of_an_exact_test(seed, size):
    mesh = soup(seed, size)
    found = crossing_faces(mesh, np.ones(60, bool))
    assert sorted(map(tuple, np.sort(found.T))) == sorted(map(tuple, np.sort(crossings(mesh))))


def wedge(count, angle, seed):
    """Random points of the surface of a prism with an edge of so many degrees."""
    chance, half = np.random.default_rng(seed), np.tan(np.radians(angle / 2))
    corners = np.array([[0, 0], [1, -half], [1, half]])
    area = np.array([1.5 / np.cos(np.radians(angle / 2)), 3 * half, 1.5 / np.cos(np.radians(angle / 2)), half, half])
    side, (u, v) = chance.choice(5, count, p=area / area.sum()), chance.random((2, count, 1))
    end, start = side >= 3, side % 3
    along = corners[start] + u * (corners[(start + 1) % 3] - corners[start])
    inside = corners[0] + np.sqrt(u) * (corners[1] + v * (corners[2] - corners[1]))
    height = np.where(end[:, None], 1.5 * (side == 4)[:, None], 1.5 * v)
    turned = np.linalg.qr(chance.normal(size=(3, 3)))[0]
    return np.column_stack([np.where(end[:, None], inside, along), height]) @ turned


@pytest.mark.parametrize("angle", [30, 60])
def test_a_sharp_edge_has_no_faces_that_cross(angle):
    points = wedge(3000, angle, 0)
    sheet = reconstruct(points, Settings(resolution=64, surface="single")).sheet
    assert len(crossings(sheet)) == 0
    assert shapes.euler(sheet) == 2
