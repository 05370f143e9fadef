import numpy as np
import pytest

from core import Mesh
from core.surface.single.orientation import orient
from tests import shapes


def shuffled(mesh, seed=0):
    """The mesh with half of its faces turned over and all in another order."""
    random = np.random.default_rng(seed)
    faces = np.where(random.random(len(mesh.faces))[:, None] < 0.5, mesh.faces[:, ::-1], mesh.faces)
    return Mesh(mesh.vertices, faces[random.permutation(len(faces))])


def band(n, twisted):
    """A strip of n quads round the unit circle, closed with or without half a twist."""
    turn = 2 * np.pi * np.arange(n) / n
    tilt = turn / 2 if twisted else np.full(n, 0.2)
    radii = [1 + side * np.cos(tilt) for side in (-0.3, 0.3)]
    heights = [side * np.sin(tilt) for side in (-0.3, 0.3)]
    rims = [np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1) for r, z in zip(radii, heights, strict=True)]
    low, high = np.arange(n), n + np.arange(n)
    after, above = np.roll(low, -1), np.roll(high, -1)
    if twisted:
        after[-1], above[-1] = above[-1], after[-1]
    faces = np.concatenate([np.stack([low, after, above], axis=1), np.stack([low, above, high], axis=1)])
    return Mesh(np.concatenate(rims), faces.astype(np.int32))


def tetrahedron(centre=(0, 0, 0)):
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
    return Mesh(np.concatenate([np.zeros((1, 3)), np.eye(3)]) - 0.25 + centre, faces)


def backward_edges(mesh):
    directed = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return len(directed) - len(np.unique(directed, axis=0))


@pytest.mark.parametrize("seed", range(4))
def test_a_closed_mesh_faces_outwards(seed):
    mesh, failures = orient(shuffled(tetrahedron(), seed))
    assert (failures, backward_edges(mesh)) == (0, 0)
    assert shapes.signed_volume(mesh) == pytest.approx(1 / 6)


@pytest.mark.parametrize("seed", range(4))
def test_an_open_band_is_wound_alike(seed):
    mesh, failures = orient(shuffled(band(20, twisted=False), seed))
    assert (failures, backward_edges(mesh)) == (0, 0)


@pytest.mark.parametrize("seed", range(4))
def test_a_moebius_band_fails_along_one_cut(seed):
    mesh, failures = orient(shuffled(band(20, twisted=True), seed))
    assert failures == backward_edges(mesh) > 0
    assert failures <= 4


def test_patches_end_where_three_sheets_meet():
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0]], float)
    assert orient(Mesh(vertices, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32)))[1] == 0


def joined(n, wide, parted):
    """Three half planes of n x `wide` quads along a line, but for the one that each step of the line, (n,), parts from
    the other two; -1 for none."""
    along, out = np.meshgrid(np.arange(n + 1), np.arange(wide + 1), indexing="ij")
    turn = 2 * np.pi / 3 * np.arange(3)[:, None, None]
    vertices = np.stack([out * np.cos(turn), out * np.sin(turn), np.broadcast_to(along, (3, *along.shape))], axis=-1)
    number = np.arange(3 * along.size).reshape(3, *along.shape)
    corners = np.stack([number[:, :-1, :-1], number[:, 1:, :-1], number[:, 1:, 1:], number[:, :-1, 1:]], axis=-1)
    for step, apart in enumerate(parted):
        for sheet in {0, 1, 2} - {apart}:
            corners[sheet, step, 0, :2] = number[(apart + 1) % 3 if apart >= 0 else 0, step : step + 2, 0]
    quads = corners.reshape(-1, 4)
    return Mesh(vertices.reshape(-1, 3), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32))


@pytest.mark.parametrize("seed", range(4))
def test_sheets_fail_where_the_line_along_which_they_meet_has_gaps(seed):
    """Each two of three are joined by themselves over some steps, which no winding of all three allows."""
    parted = np.full(30, -1)
    parted[[4, 5]], parted[[13, 14, 15]], parted[[24, 25]] = 0, 1, 2
    mesh, failures = orient(shuffled(joined(30, 12, parted), seed))
    assert 0 < failures <= 3
    far = (np.hypot(*mesh.vertices[:, :2].T)[mesh.faces] > 1).any(axis=1)
    assert backward_edges(Mesh(mesh.vertices, mesh.faces[far])) == 0


def test_patches_are_turned_one_by_one():
    """Two tetrahedra and a single face."""
    parts = shuffled(tetrahedron([-5, 0, 0]), 1), shuffled(tetrahedron([5, 0, 0]), 2)
    vertices = np.concatenate([*(part.vertices for part in parts), np.eye(3) + 9])
    faces = np.concatenate([parts[0].faces, parts[1].faces + 4, [[8, 9, 10]]])
    mesh, failures = orient(Mesh(vertices, faces.astype(np.int32)))
    assert (failures, backward_edges(mesh)) == (0, 0)
    assert abs(shapes.signed_volume(Mesh(vertices, mesh.faces[:4]))) == pytest.approx(1 / 6)


def scene():
    """Uneven ground, and a roof above a gap in it, as seen from above."""
    x, y = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    middle = np.column_stack([x.reshape(-1), y.reshape(-1)])[quads].mean(axis=1)
    roof = np.abs(middle).max(axis=1) < 0.3
    near = np.abs(np.abs(middle).max(axis=1) - 0.35) < 0.051
    ground = np.column_stack([x.reshape(-1), y.reshape(-1), 0.02 * np.sin(9 * x.reshape(-1))])
    above = ground + np.array([0, 0, 0.5])
    quads = np.concatenate([quads[~roof & ~near], quads[roof] + len(ground)])
    faces = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32)
    return Mesh(np.concatenate([ground, above]), faces)


def normals(mesh):
    a, b, c = (mesh.vertices[corner] for corner in mesh.faces.T)
    return np.cross(b - a, c - a)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_seen_from_one_side_faces_it_together(seed):
    """By itself the ground would face down, away from the roof."""
    mesh, failures = orient(shuffled(scene(), seed))
    assert failures == 0
    assert (normals(mesh)[:, 2] > 0).all()
    turned = shapes.random_rotation(seed)
    mesh, _ = orient(shuffled(Mesh(scene().vertices @ turned.T, scene().faces), seed))
    facing = np.sign(normals(mesh) @ turned[:, 2])
    assert (facing == facing[0]).all()


def test_what_lies_behind_other_parts_faces_away_from_the_middle():
    """Two sheets above one another, each a patch."""
    sheet = scene()
    vertices = np.concatenate([sheet.vertices, sheet.vertices + np.array([0, 0, 2])])
    mesh, _ = orient(shuffled(Mesh(vertices, np.concatenate([sheet.faces, sheet.faces + len(sheet.vertices)]))))
    upper = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] > 1
    assert (normals(mesh)[upper, 2] > 0).all()
    assert (normals(mesh)[~upper, 2] < 0).all()


def test_nothing_to_wind():
    assert orient(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32)))[1] == 0


def test_only_windings_change():
    given = shuffled(band(12, twisted=False))
    mesh, _ = orient(given)
    np.testing.assert_array_equal(mesh.vertices, given.vertices)
    np.testing.assert_array_equal(np.sort(mesh.faces, axis=1), np.sort(given.faces, axis=1))


@pytest.mark.parametrize("twisted", [False, True])
def test_quads_stay_quads_and_their_halves_are_wound_alike(twisted):
    plain = band(40, twisted)
    turned = np.tile(np.arange(40) % 3 == 0, 2)
    halves = np.where(turned[:, None], plain.faces[:, [0, 2, 1]], plain.faces)
    halves[:80] = np.where(turned[:, None], np.roll(halves, 40, axis=0), halves)
    found, _ = orient(Mesh(plain.vertices, halves, pairs=40))
    assert found.pairs == 40
    assert {frozenset(q) for q in found.quads.tolist()} == {
        frozenset(q) for q in Mesh(plain.vertices, plain.faces, 40).quads.tolist()
    }
    edges = np.stack([found.quads, np.roll(found.quads, -1, axis=1)], axis=2).reshape(-1, 2)
    backward = len(edges) - len(np.unique(edges, axis=0))
    assert backward <= twisted


@pytest.mark.parametrize(("middle", "pairs"), [((0, 0.5, -5), 1), ((-3, 0.5, 0.5), 0)])
def test_a_quad_whose_halves_are_wound_by_themselves_may_end_as_triangles(middle, pairs):
    """A third triangle on its diagonal parts the halves, and each is turned to face away from the middle of all
    vertices, which is above the one and below the other in the second case. A ring around them faces all ways, so
    they do not face one together."""
    corners, ring = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 1], [0, 0.5, -1]], band(20, twisted=False)
    ring.vertices[:] = 5 * ring.vertices / np.hypot(*ring.vertices[:, :2].T)[:, None]
    ring.vertices[:, 2] = np.repeat([-5, 5], 20)
    vertices = np.concatenate([corners, ring.vertices, np.tile(middle, (10000, 1))])
    faces = np.concatenate([[[0, 1, 2], [0, 2, 3], [0, 2, 4]], 5 + ring.faces]).astype(np.int32)
    found, _ = orient(Mesh(vertices, faces, pairs=1))
    assert {frozenset(face) for face in found.faces.tolist()} == {frozenset(face) for face in faces.tolist()}
    assert found.pairs == pairs
