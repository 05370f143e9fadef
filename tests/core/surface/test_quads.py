"""Meshes of quads: the same surface as the triangles', manifold as polygons too."""

import importlib

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from core import MissingDependency, Settings, reconstruct
from tests import shapes

CASES = {
    "sphere": (shapes.sphere(500), "both"),
    "torus": (shapes.torus(1000), "signed"),
    "disc": (shapes.disc(400), "both"),
    "junction": (shapes.junction(1000), "both"),
    "moebius": (shapes.moebius(1000), "both"),
}


@pytest.fixture(scope="module")
def runs():
    """By case and setting `faces`."""
    return {
        (name, faces): reconstruct(points, Settings(resolution=32, surface=surface, faces=faces))
        for name, (points, surface) in CASES.items()
        for faces in ("triangles", "quads")
    }


def meshes(run):
    return [mesh for mesh in (run.surface, run.sheet) if mesh is not None]


def directed_edges(mesh):
    """Of the polygons, (e,2)."""
    ends = [np.stack([f, np.roll(f, -1, axis=1)], axis=2).reshape(-1, 2) for f in (mesh.quads, mesh.triangles)]
    return np.concatenate(ends).astype(np.int64)


def fans(mesh):
    """How many fans of quads there are around all vertices: corners of a vertex hang together by edges they share."""
    quads, size = mesh.quads.astype(np.int64), 4 * mesh.pairs
    corner = np.arange(size).reshape(-1, 4)
    tail, head = quads, np.roll(quads, -1, axis=1)
    at_tail, at_head = corner, np.roll(corner, -1, axis=1)
    forward = tail * len(mesh.vertices) + head
    backward = head * len(mesh.vertices) + tail
    _, here, there = np.intersect1d(forward, backward, return_indices=True)
    links = [
        (at_tail.reshape(-1)[here], at_head.reshape(-1)[there]),
        (at_head.reshape(-1)[here], at_tail.reshape(-1)[there]),
    ]
    a, b = (np.concatenate(ends) for ends in zip(*links, strict=True))
    return connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(size, size)), directed=False)[0]


@pytest.mark.parametrize("name", CASES)
def test_the_surface_is_that_of_the_triangles(runs, name):
    for plain, mesh in zip(meshes(runs[name, "triangles"]), meshes(runs[name, "quads"]), strict=True):
        np.testing.assert_array_equal(mesh.vertices, plain.vertices)
        np.testing.assert_array_equal(mesh.faces, plain.faces)
        assert plain.pairs == 0
        assert len(plain.triangles) == len(plain.faces)
        assert mesh.pairs > 0


@pytest.mark.parametrize("name", CASES)
def test_closed_meshes_are_of_quads_alone_and_manifold(runs, name):
    mesh = runs[name, "quads"].surface
    assert len(mesh.triangles) == 0
    edges = directed_edges(mesh)
    assert len(np.unique(edges, axis=0)) == len(edges)
    np.testing.assert_array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))
    assert fans(mesh) == len(mesh.vertices)


@pytest.mark.parametrize(("name", "share"), [("sphere", 0), ("disc", 0), ("moebius", 0), ("junction", 0.02)])
def test_single_layers_keep_triangles_where_sheets_meet_alone(runs, name, share):
    sheet = runs[name, "quads"].sheet
    assert len(sheet.triangles) <= share * sheet.pairs
    assert (np.diff(np.sort(sheet.quads, axis=1), axis=1) > 0).all()
    report = runs[name, "quads"].report["meshes"]["single"]
    assert (report["quads"], report["triangles"]) == (sheet.pairs, len(sheet.triangles))
    assert report["faces"] == 2 * sheet.pairs + len(sheet.triangles)


@pytest.mark.parametrize("name", ["sphere", "disc"])
def test_the_quads_of_a_layer_are_wound_alike(runs, name):
    edges = directed_edges(runs[name, "quads"].sheet)
    assert len(np.unique(edges, axis=0)) == len(edges)


def test_quads_are_shaped_well(runs):
    found = runs["sphere", "quads"].report["meshes"]["double"]
    assert found["quad_angle"] > 65
    assert found["quad_aspect_p95"] < 2.5
    assert found["quad_fold_p95"] < 15
    assert found["quad_concave"] < 0.01


def test_without_openvdb_the_message_names_the_ways_out(monkeypatch):
    def missing():
        raise MissingDependency("OpenVDB is not installed")

    monkeypatch.setattr(importlib.import_module("core.surface.meshing.isosurface"), "load_openvdb", missing)
    with pytest.raises(MissingDependency, match=r"quads need OpenVDB.*set faces to triangles"):
        reconstruct(shapes.sphere(200), Settings(resolution=16, faces="quads"))
