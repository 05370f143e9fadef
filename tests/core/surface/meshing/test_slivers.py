"""Slivers, on an iso-surface flattened as the double cover of a sheet is, and where taking them out would tear."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Mesh, Settings, reconstruct
from core.surface.meshing.isosurface import isosurface
from core.surface.meshing.quality import triangle_quality
from core.surface.meshing.slivers import without_slivers
from core.surface.meshing.triangles import mesh_of
from tests import shapes

CELL = 0.08
MIDDLE = 16.3, 16.1, 4.2  # cells, off the nodes


@pytest.fixture(scope="module")
def flat() -> Mesh:
    """The iso-surface a cell off a disc of radius 1, each vertex pulled onto it but for a thousandth of a cell."""
    nodes = CELL * (np.indices((33, 33, 9)).reshape(3, -1).T - MIDDLE)
    vertices, quads = isosurface(shapes.disc_distance(nodes).reshape(33, 33, 9).astype(np.float32), CELL)
    vertices = CELL * (vertices - MIDDLE)
    vertices[:, :2] /= np.maximum(np.linalg.norm(vertices[:, :2], axis=1), 1)[:, None]
    vertices[:, 2] = 1e-3 * np.clip(vertices[:, 2], -CELL, CELL)
    return mesh_of(vertices, quads)


def tube(radius: float) -> Mesh:
    """A torus of ring 1 whose tube has three sides."""
    turn, phi = np.meshgrid(2 * np.pi / 60 * np.arange(60), 2 * np.pi / 3 * np.arange(3), indexing="ij")
    out = 1 + radius * np.cos(phi)
    vertices = np.stack([out * np.cos(turn), out * np.sin(turn), radius * np.sin(phi)], axis=-1).reshape(-1, 3)
    row, column = np.indices((60, 3)).reshape(2, -1)
    corners = [(row + i) % 60 * 3 + (column + j) % 3 for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return mesh_of(vertices, np.stack(corners, axis=1))


def is_manifold(mesh):
    """Whether it is closed and wound alike, with one fan of faces around each vertex."""
    sides = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    turned = np.concatenate([np.roll(mesh.faces, k, axis=1) for k in range(3)]).tolist()
    follows, seen, fans = {(a, b): (a, c) for a, b, c in turned}, set(), np.zeros(len(mesh.vertices), int)
    for start in follows:
        fans[start[0]] += start not in seen
        while start not in seen:
            seen.add(start)
            start = follows[start]
    return len(follows) == len(sides) and set(mesh.edge_counts()[1]) == {2} and (fans == 1).all()


def test_a_flattened_mesh_is_as_even_at_its_rim_as_inside(flat):
    assert triangle_quality(flat)["small_angles"] > 0.2
    mesh = without_slivers(flat, CELL)
    assert triangle_quality(mesh)["least_angle"] > 5
    assert is_manifold(mesh)
    assert shapes.euler(mesh) == 2
    np.testing.assert_array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))


def test_its_rim_stays_where_it_is(flat):
    mesh = without_slivers(flat, CELL)
    out, turn = np.linalg.norm(mesh.vertices, axis=1), np.arctan2(mesh.vertices[:, 1], mesh.vertices[:, 0])
    on_rim = out > 1 - 0.02 * CELL
    assert 80 < on_rim.sum() < 0.35 * (np.linalg.norm(flat.vertices, axis=1) > 1 - 0.02 * CELL).sum()
    assert np.diff(np.sort(turn[on_rim])).max() < 1.3 * CELL
    assert mesh.face_areas().sum() == pytest.approx(2 * np.pi, rel=0.002)


def test_what_is_away_from_the_rim_is_left_as_it_is(flat):
    mesh = without_slivers(flat, CELL)

    def inner(mesh):
        corners = mesh.vertices[mesh.faces]
        return {face.tobytes() for face in corners[(np.linalg.norm(corners, axis=2) < 1 - 3 * CELL).all(axis=1)]}

    assert len(inner(flat)) > 700
    assert inner(flat) <= inner(mesh)


def test_quads_stay_whole_or_are_triangles(flat):
    mesh = without_slivers(flat, CELL)
    assert 0.6 * flat.pairs < mesh.pairs < 0.8 * flat.pairs
    halves = mesh.faces[: 2 * mesh.pairs].reshape(2, mesh.pairs, 3)
    np.testing.assert_array_equal(halves[0][:, [0, 2]], halves[1][:, [0, 1]])
    middles = KDTree(flat.vertices[flat.quads].mean(axis=1))
    assert middles.query(mesh.vertices[mesh.quads].mean(axis=1))[0].max() < 0.15 * CELL  # moved with a corner


def test_a_tube_thinner_than_short_edges_stays_a_tube():
    thin = tube(0.05)
    mesh = without_slivers(thin, 0.5)
    assert len(mesh.vertices) < 0.7 * len(thin.vertices)
    assert is_manifold(mesh)
    assert shapes.euler(mesh) == 0


def test_a_tetrahedron_of_short_edges_and_an_even_mesh_stay_as_they_are():
    corners = 0.01 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], np.int32)
    assert shapes.euler(without_slivers(Mesh(corners, faces), 1.0)) == 2
    assert len(without_slivers(Mesh(corners, faces), 1.0).faces) == 4
    even = tube(0.5)
    assert without_slivers(even, 0.1) is even


def test_the_cover_of_sheets_that_meet_where_samples_do_not_show_it_has_none():
    random = np.random.default_rng(0)
    flat, upright = random.uniform(-1, 1, (2, 2000, 3)) * [[[1, 1, 0]], [[1, 0, 1]]]
    noise = 0.003 * random.normal(size=(4000, 3))
    run = reconstruct(np.concatenate([flat, upright]) + noise, Settings(resolution=64, denoise=0))
    quality = run.report["meshes"]["double"]
    assert quality["small_angles"] < 0.02
    assert quality["aspect_p95"] < 5
