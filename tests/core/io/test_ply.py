import os
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from plyfile import PlyData

from core import InputError, Mesh, VADError
from core.io.ply import write_mesh, write_points
from core.io.points import read_points, read_scan

coordinates = st.floats(-1e12, 1e12)
FAR_TETRAHEDRON = Mesh(
    np.vstack([np.zeros(3), np.eye(3)]) + np.array([4_500_000.123456, 500_000.654321, 0.1]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], np.int32),
)
TRIANGLE = Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("written")


def test_a_mesh_comes_back_exactly(folder):
    write_mesh(folder / "mesh.ply", FAR_TETRAHEDRON)
    data = PlyData.read(folder / "mesh.ply")
    assert (data.text, data.byte_order) == (False, "<")
    np.testing.assert_array_equal(read_points(folder / "mesh.ply"), FAR_TETRAHEDRON.vertices)
    np.testing.assert_array_equal(np.stack(data["face"]["vertex_indices"]), FAR_TETRAHEDRON.faces)


def test_the_bytes_are_those_the_format_prescribes(folder):
    mesh = Mesh(np.array([[0.1, 0.2, 0.3]] * 3), np.array([[0, 1, 2]], np.int32))
    write_mesh(folder / "mesh.ply", mesh)
    header = (
        b"ply\nformat binary_little_endian 1.0\ncomment made by VAD (Voronoi-Assisted Diffusion)\n"
        b"element vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = struct.pack("<3d", 0.1, 0.2, 0.3) * 3 + struct.pack("<B3i", 3, 0, 1, 2)
    assert (folder / "mesh.ply").read_bytes() == header + body


@pytest.mark.parametrize(("pairs", "sizes"), [(0, [3] * 4), (1, [4, 3, 3]), (2, [4, 4])])
def test_quads_are_written_as_such_before_the_triangles(folder, pairs, sizes):
    mesh = Mesh(FAR_TETRAHEDRON.vertices, FAR_TETRAHEDRON.faces, pairs)
    write_mesh(folder / "mesh.ply", mesh)
    data = PlyData.read(folder / "mesh.ply")
    found = [face.tolist() for face in data["face"]["vertex_indices"]]
    assert found == [*mesh.quads.tolist(), *mesh.triangles.tolist()]
    assert [len(face) for face in found] == sizes
    assert b"property list uchar int vertex_indices" in (folder / "mesh.ply").read_bytes()


def test_an_empty_mesh(folder):
    write_mesh(folder / "mesh.ply", Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)))
    assert [len(element) for element in PlyData.read(folder / "mesh.ply")] == [0, 0]


@settings(deadline=None)
@given(arrays(np.float64, st.tuples(st.integers(0, 5), st.just(7)), elements=coordinates), st.booleans())
def test_points_come_back_with_normals_and_confidence(folder, table, confident):
    points, normals, confidence = table[:, :3], table[:, 3:6], table[:, 6] if confident else None
    write_points(folder / "points.ply", points, normals, {"confidence": confidence} if confident else None)
    vertex = PlyData.read(folder / "points.ply")["vertex"]
    assert [p.name for p in vertex.properties] == ["x", "y", "z", "nx", "ny", "nz"] + ["confidence"] * confident
    np.testing.assert_array_equal(np.stack([vertex[n] for n in ("x", "y", "z")], axis=1), points)
    np.testing.assert_array_equal(np.stack([vertex[n] for n in ("nx", "ny", "nz")], axis=1), np.float32(normals))
    if confident:
        np.testing.assert_array_equal(vertex["confidence"], confidence)


@pytest.mark.parametrize("order", "<>")
def test_attributes_of_vertices_keep_their_type_and_come_back(folder, order):
    given = {
        "red": np.array([0, 7, 255, 1], np.uint8),
        "scalar_Return_Number": np.array([-1, 2, 3, 4], order + "i4"),
        "gps_time": np.array([1e9 + 1e-3, 0, 1, 2], order + "f8"),
        "nx": np.ones(4, order + "f4"),
    }
    write_mesh(folder / "mesh.ply", FAR_TETRAHEDRON, given)
    points, found = read_scan(folder / "mesh.ply")
    np.testing.assert_array_equal(points, FAR_TETRAHEDRON.vertices)
    assert list(found) == ["red", "scalar_Return_Number", "gps_time"]  # normals are not carried
    for name, values in found.items():
        np.testing.assert_array_equal(values, given[name])
        assert values.dtype == given[name].dtype.newbyteorder("<")


@pytest.mark.parametrize(
    ("values", "written"),
    [
        (np.array([0, 1, -(2**31)]), np.int32),
        (np.array([0, 1, 2**40]), np.float64),
        (np.array([0, 1, 2], np.uint64), np.int32),
        (np.array([0, 1, 2.5], np.float16), np.float64),
        (np.array([True, False, True]), np.uint8),
        ([1, 2, 3], np.int32),
    ],
)
def test_attributes_of_types_that_ply_lacks_are_written_as_others(folder, values, written):
    write_mesh(folder / "m.ply", TRIANGLE, {"id": values})
    found = read_scan(folder / "m.ply")[1]["id"]
    assert found.dtype == written
    np.testing.assert_array_equal(found, np.asarray(values))


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("x", np.zeros(3), "named 'x'.*other than x, y, z"),
        ("my id", np.zeros(3), "without blanks"),
        ("Größe", np.zeros(3), "in ASCII"),
        ("", np.zeros(3), "named ''"),
        (3, np.zeros(3), "named 3; choose a name"),
        (None, np.zeros(3), "named None; choose a name"),
        ("id", np.zeros(2), r"shape \(2,\); give 3 rows"),
        ("id", [1, [2, 3], 4], r"no array \(.*\); give 3 rows"),
        ("id", np.ma.masked_equal([1.0, 2, 2], 2), "masked in 2 rows; give a number for each"),
        ("id", np.zeros((3, 2)), r"shape \(3, 2\)"),
        ("id", np.array(["a", "b", "c"]), "type <U1"),
        ("id", np.array([1, None, 3]), "type object"),
    ],
)
def test_attributes_that_ply_cannot_hold_are_refused(folder, name, values, said):
    with pytest.raises(InputError, match=said):
        write_mesh(folder / "n.ply", TRIANGLE, {name: values})
    assert not (folder / "n.ply").exists()


@pytest.mark.parametrize("points", [np.zeros((3, 2)), "abc", [[0, 0, 1j]]])
def test_points_that_are_none_are_refused(tmp_path, points):
    with pytest.raises(InputError, match="points"):
        write_points(tmp_path / "p.ply", points, np.zeros((3, 3)))
    assert os.listdir(tmp_path) == []


def test_so_are_normals_of_others(tmp_path):
    with pytest.raises(InputError, match=r"normals have shape \(2, 3\) and points \(3, 3\)"):
        write_points(tmp_path / "p.ply", np.zeros((3, 3)), np.zeros((2, 3)))


def test_a_failed_write_leaves_nothing(tmp_path):
    with pytest.raises(VADError, match="cannot be written"):
        write_mesh(tmp_path / "missing" / "mesh.ply", FAR_TETRAHEDRON)
    assert os.listdir(tmp_path) == []
