"""Both backends, OpenVDB and scikit-image, give a closed mesh of the level set."""

import importlib
import sys

import numpy as np
import pytest

from core import Mesh, MissingDependency
from core.field.blocks import blocks_of, table_shape
from core.io.openvdb_module import load_openvdb
from core.surface.meshing.isosurface import isosurface
from tests import shapes

MODULE = importlib.import_module("core.surface.meshing.isosurface")
CENTRE = np.array([15.3, 16.1, 14.8])


def missing():
    raise MissingDependency("OpenVDB is not installed")


@pytest.fixture(params=["openvdb", "skimage"])
def backend(request, monkeypatch):
    if request.param == "openvdb":
        load_openvdb()
    else:
        pytest.importorskip("skimage")
        monkeypatch.setattr(MODULE, "load_openvdb", missing)
    return request.param


def ball():
    """Distance to CENTRE, in cells."""
    return np.linalg.norm(np.indices((32, 33, 31)) - CENTRE[:, None, None, None], axis=0).astype(np.float32)


def triangles(faces):
    return faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


@pytest.mark.parametrize("level", [6.0, 9.5])
def test_a_sphere_is_closed_and_in_place(backend, level):
    vertices, faces = isosurface(ball(), level)
    mesh = Mesh(vertices, triangles(faces))
    assert (vertices.dtype, faces.dtype) == (np.float64, np.int64)
    np.testing.assert_allclose(np.linalg.norm(vertices - CENTRE, axis=1), level, atol=0.12)
    assert set(mesh.edge_counts()[1]) == {2}
    assert shapes.euler(mesh) == 2
    assert len(shapes.components(mesh)) == 1
    assert abs(shapes.signed_volume(mesh)) == pytest.approx(4 / 3 * np.pi * level**3, rel=0.05)


def test_a_plane_lies_where_the_values_cross_the_level(backend):
    vertices, _ = isosurface(np.broadcast_to(np.arange(10, dtype=np.float32), (8, 9, 10)).copy(), 4.25)
    inside = ((vertices > 1) & (vertices < [6, 7, 8])).all(axis=1)
    assert inside.sum() >= 20
    np.testing.assert_allclose(vertices[inside, 2], 4.25, atol=1e-5)


def test_the_shell_of_an_unsigned_distance_has_two_sides(backend):
    vertices, faces = isosurface(np.abs(ball() - 8), 1.0)
    pieces = shapes.components(Mesh(vertices, triangles(faces)))
    assert [shapes.euler(piece) for piece in pieces] == [2, 2]


def test_openvdb_winds_faces_towards_larger_values():
    load_openvdb()
    vertices, faces = isosurface(ball(), 9.0)
    assert shapes.signed_volume(Mesh(vertices, triangles(faces))) > 0


def test_openvdb_closes_what_leaves_the_box():
    load_openvdb()
    vertices, faces = isosurface(ball(), 16.0)
    assert set(Mesh(vertices, triangles(faces)).edge_counts()[1]) == {2}


def test_without_either_library_the_message_names_the_ways_out(monkeypatch):
    monkeypatch.setattr(MODULE, "load_openvdb", missing)
    monkeypatch.setitem(sys.modules, "skimage.measure", None)
    with pytest.raises(MissingDependency, match=r"scikit-image.*set surface to none"):
        isosurface(ball(), 5.0)


def in_blocks(values):
    """The array in blocks; those of its largest or smallest value throughout are not stored."""
    blocks = blocks_of(values.shape, np.arange(np.prod(table_shape(values.shape))), values.max())
    blocks.put(np.arange(values.size), values.reshape(-1))
    return blocks.merged()


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_blocks_give_the_surface_of_the_whole_box(level):
    load_openvdb()
    values = np.clip(ball() - 11.5, -3, 3)
    sparse = in_blocks(values)
    assert len(sparse.stored) < np.prod(sparse.slot.shape)
    expected, faces = isosurface(values, level)
    found, quads = isosurface(sparse, level)
    order, other = np.lexsort(expected.T), np.lexsort(found.T)
    np.testing.assert_array_equal(found[other], expected[order])
    assert len(quads) == len(faces)


def test_blocks_need_openvdb(monkeypatch):
    monkeypatch.setattr(MODULE, "load_openvdb", missing)
    with pytest.raises(MissingDependency, match=r"band needs OpenVDB.*set band to none, with a resolution of 512"):
        isosurface(in_blocks(np.minimum(ball(), 3)), 1.0)
