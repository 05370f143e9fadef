"""Faces of .obj and .ply files."""

import numpy as np
import pytest
from plyfile import PlyData, PlyElement

from core import Mesh
from core.io.faces import read_faces
from core.io.ply import write_mesh
from core.io.points import read_points

CORNERS = [[0, 1, 2], [0, 2, 3, 4]]
VERTICES = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nv -1 0 2\n"


def lists(corners, sizes):
    return [part.tolist() for part in np.split(corners, np.cumsum(sizes)[:-1])] if len(sizes) else []


@pytest.mark.parametrize(
    "text",
    [
        VERTICES + "f 1 2 3\nf 1 3 4 5\n",
        VERTICES + "vt 0 0\nvn 0 0 1\ns off\nf 1/1/1 2/1 3//1  # a comment\n  f\t1 3 4 5",
        VERTICES + "f -5 -4 -3\nf -5 -3 -2 -1\n",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 1\nv -1 0 2\nf 1 3 4 5\n",
    ],
)
def test_faces_of_obj_files(tmp_path, text):
    path = tmp_path / "part.OBJ"
    path.write_text(text)
    assert len(read_points(path)) == 5
    assert lists(*read_faces(path, 5)) == CORNERS


@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
@pytest.mark.parametrize("text", [True, False])
def test_faces_of_ply_files(tmp_path, name, text):
    path = tmp_path / "part.ply"
    faces = np.empty(2, [(name, object)])
    faces[name][:] = [np.array(face) for face in CORNERS]
    vertices = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1), (-1, 0, 2)], [(axis, "f4") for axis in "xyz"])
    elements = [PlyElement.describe(vertices, "vertex"), PlyElement.describe(faces, "face", val_types={name: "i4"})]
    PlyData(elements, text=text).write(str(path))
    assert len(read_points(path)) == 5
    assert lists(*read_faces(path, 5)) == CORNERS


def test_those_of_written_meshes_are_read(tmp_path):
    mesh = Mesh(np.random.default_rng(0).random((5, 3)), np.array([[0, 2, 3], [0, 3, 4], [0, 1, 2]]), 1)
    write_mesh(tmp_path / "part.ply", mesh)
    assert lists(*read_faces(tmp_path / "part.ply", 5)) == [mesh.quads[0].tolist(), [0, 1, 2]]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "0 0 0\n1 0 0\n"),
        ("a.obj", VERTICES),
        ("a.obj", VERTICES + "f 1 2 9\n"),
        ("a.obj", VERTICES + "f 0 1 2\n"),
        ("a.obj", VERTICES + "f a b c\n"),
        ("a.obj", VERTICES + "f 1 2 99999999999999999999\n"),
        ("a.obj", VERTICES + "f\n"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 1\nproperty float area\n"
            "end_header\n0\n1\n",
        ),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n0\n3 0 0\n",
        ),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 1\n"
            "property list uchar float vertex_indices\nend_header\n0\n3 0 1 nan\n",
        ),
    ],
)
def test_where_there_are_none_or_unsound_ones_there_are_none(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    corners, sizes = read_faces(path, 5)
    assert (corners.shape, sizes.shape) == ((0,), (0,))
    assert corners.dtype == sizes.dtype == np.int64
