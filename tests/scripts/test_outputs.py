"""What the readers give back is what the library wrote."""

import numpy as np

from core import DistanceField, Mesh
from core.io.ply import write_mesh, write_points
from core.io.vdb import write_vdb
from scripts.outputs import read_field, read_mesh, read_points

RNG = np.random.default_rng(0)


def test_points(tmp_path):
    points, normals = RNG.normal(size=(20, 3)), RNG.normal(size=(20, 3))
    write_points(tmp_path / "a.ply", points, normals)
    read, axes = read_points(tmp_path / "a.ply")
    np.testing.assert_array_equal(read, points)
    np.testing.assert_allclose(axes, normals, rtol=1e-6)


def test_mesh(tmp_path):
    mesh = Mesh(RNG.normal(size=(4, 3)), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    write_mesh(tmp_path / "a.ply", mesh)
    read = read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(read.vertices, mesh.vertices)
    np.testing.assert_array_equal(read.faces, mesh.faces)


def test_field(tmp_path):
    field = DistanceField(RNG.random((5, 6, 7), np.float32), np.array([1.0, -2.0, 30.0]), 0.25)
    write_vdb(tmp_path / "a.vdb", field)
    read = read_field(tmp_path / "a.vdb")
    np.testing.assert_array_equal(read.values, field.values)
    np.testing.assert_allclose(read.origin, field.origin)
    assert read.spacing == field.spacing
