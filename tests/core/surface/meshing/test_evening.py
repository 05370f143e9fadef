import numpy as np

from core import Mesh
from core.surface.meshing.evening import evened
from core.surface.meshing.quality import quad_quality, triangle_quality
from core.surface.meshing.triangles import mesh_of, triangles

SIDE = 12


def uneven(height, seed=0):
    """A square of quads whose inner vertices are off their places, along the middle line alone on that, and
    z = height(x, y)."""
    x, y = np.meshgrid(np.arange(SIDE + 1.0), np.arange(SIDE + 1.0), indexing="ij")
    off = np.random.default_rng(seed).uniform(-0.35, 0.35, (2, *x.shape))
    off[:, [0, -1]], off[:, :, [0, -1]], off[0, SIDE // 2] = 0, 0, 0
    x, y = x + off[0], y + off[1]
    corner = np.arange(x.size).reshape(x.shape)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=2).reshape(-1, 4)
    return np.stack([x, y, height(x, y)], axis=2).reshape(-1, 3), quads


def slope(x, y):
    return 0.3 * x - 0.2 * y


def bowl(x, y):
    return 0.02 * ((x - SIDE / 2) ** 2 + (y - SIDE / 2) ** 2)


def crease(x, y):
    return 2 * np.abs(x - SIDE / 2)


def test_quads_get_even_within_the_surface():
    vertices, quads = uneven(slope)
    moved = evened(vertices, quads)
    np.testing.assert_allclose(moved[:, 2], slope(*moved[:, :2].T), atol=1e-12)
    before, after = (quad_quality(mesh_of(x, quads)) for x in (vertices, moved))
    assert after["quad_aspect_p95"] < 0.8 * before["quad_aspect_p95"]
    assert after["quad_angle"] > before["quad_angle"] + 3


def test_triangles_get_even_within_the_surface():
    vertices, quads = uneven(slope)
    faces = triangles(vertices, quads)
    moved = evened(vertices, faces)
    np.testing.assert_allclose(moved[:, 2], slope(*moved[:, :2].T), atol=1e-12)
    before, after = (triangle_quality(Mesh(x, faces)) for x in (vertices, moved))
    assert after["min_angle"] > before["min_angle"] + 3


def test_a_bowl_does_not_get_flatter():
    vertices, quads = uneven(bowl)
    moved = evened(vertices, quads)
    off = moved[:, 2] - bowl(*moved[:, :2].T)
    assert np.abs(off.mean()) < 0.005
    assert np.abs(off).max() < 0.03


def test_borders_and_what_is_fixed_stay():
    vertices, quads = uneven(slope)
    fixed = np.arange(len(vertices)) % 7 == 0
    moved = evened(vertices, quads, fixed)
    at = vertices[:, :2]
    stays = fixed | (at == 0).any(axis=1) | (at == SIDE).any(axis=1)
    np.testing.assert_array_equal((moved == vertices).all(axis=1), stays)


def test_edges_where_sheets_meet_stay():
    """A second square stands on the middle line of the first."""
    vertices, quads = uneven(lambda x, y: 0 * x)
    line = np.flatnonzero(np.isin(np.arange(len(vertices)) // (SIDE + 1), SIDE // 2))
    upper = len(vertices) + np.arange(len(line))
    wall = np.stack([line[:-1], line[1:], upper[1:], upper[:-1]], axis=1)
    every = np.concatenate([vertices, vertices[line] + [0, 0, 1]])
    moved = evened(every, np.concatenate([quads, wall]))
    np.testing.assert_array_equal(moved[line], every[line])
    assert (moved[: len(vertices)] != vertices).any(axis=1).sum() > 50


def test_creases_stay_sharp():
    vertices, quads = uneven(crease)
    moved = evened(vertices, quads)
    near = vertices[:, 0] == SIDE / 2
    assert near.sum() == SIDE + 1
    np.testing.assert_array_equal(moved[near], vertices[near])
    np.testing.assert_allclose(moved[:, 2], crease(*moved[:, :2].T), atol=1e-12)


def test_no_faces():
    assert evened(np.zeros((0, 3)), np.zeros((0, 4), np.int64)).shape == (0, 3)
