import numpy as np

from core import Mesh
from core.surface.meshing.centring import centred
from core.surface.meshing.triangles import mesh_of
from tests.core.surface.meshing.test_evening import SIDE, bowl, crease, slope, uneven


def ball(n=24):
    """A sphere of radius 1 made of the six sides of a cube of n x n quads, wound outwards."""
    x, y = np.meshgrid(*[np.tan(np.linspace(-np.pi / 4, np.pi / 4, n + 1))] * 2, indexing="ij")
    corner = np.arange(x.size).reshape(x.shape)
    side = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=2).reshape(-1, 4)
    face = np.stack([x, y, np.ones_like(x)], axis=2).reshape(-1, 3)
    turns = [np.roll(face * [sign, 1, sign], k, axis=1) for k in range(3) for sign in (1, -1)]
    vertices, number = np.unique(np.round(np.concatenate(turns), 9), axis=0, return_inverse=True)
    quads = number.reshape(-1)[np.concatenate([side + k * x.size for k in range(6)])]
    return mesh_of(vertices / np.linalg.norm(vertices, axis=1, keepdims=True), quads)


def off_centroids(mesh):
    return np.linalg.norm(mesh.vertices[mesh.faces].mean(axis=1), axis=1) - 1


def mean_off(mesh):
    """Mean distance from a sphere, over many points of each face."""
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 200)
    places = np.einsum("wk,fki->fwi", weights, mesh.vertices[mesh.faces])
    return np.abs(np.linalg.norm(places, axis=2) - 1).mean()


def test_faces_of_a_ball_are_half_outside_and_half_inside():
    before = ball()
    after = centred(before)
    at_vertices = np.linalg.norm(after.vertices, axis=1) - 1
    np.testing.assert_allclose(at_vertices.mean(), -2 / 3 * off_centroids(before).mean(), rtol=0.02)
    assert abs(off_centroids(after).mean() + 0.5 * at_vertices.mean()) < 0.02 * at_vertices.mean()
    assert mean_off(after) < 0.27 * mean_off(before)  # half of what centroids are off leaves .38
    assert (at_vertices > 0).all()
    assert after.pairs == before.pairs


def test_a_mesh_inside_out_moves_the_same_way():
    mesh = ball()
    inside_out = Mesh(mesh.vertices, mesh.faces[:, ::-1])
    np.testing.assert_allclose(centred(inside_out).vertices, centred(mesh).vertices, atol=1e-12)


def test_a_plane_and_the_rim_of_a_bowl_stay():
    flat = mesh_of(*uneven(slope))
    np.testing.assert_allclose(centred(flat).vertices, flat.vertices, atol=1e-12)
    curved = mesh_of(*uneven(bowl))
    rim = np.isin(curved.vertices[:, :2], [0, SIDE]).any(axis=1)
    moved = (centred(curved).vertices != curved.vertices).any(axis=1)
    assert moved[~rim].all()
    assert not moved[rim].any()


def test_creases_stay():
    creased = mesh_of(*uneven(crease))
    np.testing.assert_allclose(centred(creased).vertices, creased.vertices, atol=1e-12)


def test_vertices_at_sheets_that_meet_stay():
    curved = mesh_of(*uneven(bowl))
    middle = len(curved.vertices) // 2
    third = curved.vertices[middle] - [0, 0, 5]
    fan = curved.faces[(curved.faces == middle).any(axis=1)][0]
    faces = np.concatenate([curved.faces, [[fan[0], fan[1], len(curved.vertices)]]]).astype(np.int32)
    mesh = Mesh(np.concatenate([curved.vertices, [third]]), faces)
    moved = (centred(mesh).vertices != mesh.vertices).any(axis=1)
    assert not moved[fan[:2]].any()
