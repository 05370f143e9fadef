"""Smooth borders by closed form, and by what must not change. Resolutions are those of the shared runs."""

import numpy as np
import pytest

from core import Mesh, Settings, reconstruct
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.single import routes
from core.surface.single.rims import at_rims, smooth_rims
from tests import shapes

LENGTH, FARTHEST = 1.5, 0.3  # smoothing length and limit in local spacings, as the module says
SPACING = 0.04


def scattered_disc(n):
    radius, turn = np.sqrt(np.random.default_rng(0).random(n)), 2 * np.pi * np.random.default_rng(1).random(n)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(n)])


CLOUDS = {
    "disc": shapes.disc(800),
    "scattered": scattered_disc(1500),
    "hemisphere": shapes.hemisphere(1500),
    "junction": shapes.junction(2000) @ shapes.random_rotation(1).T,
}


@pytest.fixture(scope="module")
def pairs():
    """Meshes before and after, and the local spacings of their borders' vertices, in the samples' own units."""
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        for name, points in CLOUDS.items():

            def kept(mesh, surface, cell, at, name=name):
                after = smooth_rims(mesh, surface, cell)
                spacing = surface.spacing[surface.tree.query(mesh.vertices)[1]]
                found[name] = mesh, after, spacing, surface.points
                return after

            patch.setattr(routes, "smooth_rims", kept)
            reconstruct(points, Settings(resolution=48, surface="single"))
    return found


def border(mesh):
    edges, counts = mesh.edge_counts()
    return edges[counts == 1]


def length(mesh):
    return np.linalg.norm(np.diff(mesh.vertices[border(mesh)], axis=1), axis=2).sum()


def smallest_angles(mesh):
    """Of the triangles at borders, degrees."""
    corners = mesh.vertices[mesh.faces[np.isin(mesh.faces, border(mesh)).any(axis=1)]]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(ahead, behind), axis=2)
    return np.degrees(np.arctan2(sine, np.einsum("fki,fki->fk", ahead, behind))).min(axis=1)


@pytest.mark.parametrize(("name", "least"), [("disc", 1.5), ("scattered", 1.2), ("hemisphere", 2.0)])
def test_a_round_rim_scatters_less(pairs, name, least):
    """About its circle, and its length is nearer to the circle's."""
    before, after, _, points = pairs[name]
    middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
    scatter, radius, more = [], [], []
    for mesh in (before, after):
        place = mesh.vertices[np.unique(border(mesh))] - middle
        away = np.column_stack([np.hypot(place[:, 0], place[:, 1]), place[:, 2]])
        scatter.append(np.linalg.norm(away.std(axis=0)))
        radius.append(away[:, 0].mean())
        more.append(abs(length(mesh) / (2 * np.pi * radius[-1]) - 1))
    assert scatter[0] > least * scatter[1]
    assert more[0] > 3 * more[1]
    assert radius[1] == pytest.approx(radius[0], rel=0.01)


@pytest.mark.parametrize("waves", [6, 30, 48])
def test_waves_of_a_rim_are_damped_as_the_biharmonic_operator_damps_them(waves):
    """By 1 / (1 + (k s)^4) with the wave number k and the smoothing length s."""
    height, count = 1e-3, 720
    turn = 2 * np.pi * np.arange(count) / count
    mesh = annulus(1 + height * np.cos(waves * turn), 0.7 + 0 * turn)
    found = np.linalg.norm(smooth_rims(mesh, flat_surface(), 0.01).vertices[:count, :2], axis=1)
    damped = height / (1 + (waves * LENGTH * SPACING) ** 4)
    assert 2 * np.mean((found - 1) * np.cos(waves * turn)) == pytest.approx(damped, rel=0.05)
    assert found.mean() == pytest.approx(1, abs=1e-4)


def test_borders_are_taken_to_the_rim():
    """To the same place from inside it and from outside, where the surface ends; other vertices stay."""
    surface, cell, count = flat_surface(), 0.02, 720
    found = []
    for radius in (1 - 0.4 * cell, 1 + 0.8 * cell):
        mesh = annulus(np.full(count, radius), np.full(count, 0.7))
        at = at_rims(mesh, surface, cell)
        found.append(at[:count])
        np.testing.assert_array_equal(at[count:-count], mesh.vertices[count:-count])
    assert np.median(np.linalg.norm(found[1] - found[0], axis=1)) < 0.1 * cell
    outside = found[0] * (1 + 0.5 * cell)
    assert surface.project(found[0]).distance.mean() < 0.02 * cell
    assert surface.project(outside).distance.mean() > 0.4 * cell


def test_faces_that_lie_opposite_each_other_have_no_way_out_between_them():
    """Of the ways out of both only rounding is left, which tells no direction."""
    turn = np.pi * np.array([0.1, 0.3, 1.1, 1.3])
    around = 0.1 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    bow = Mesh(np.array([0.1, 0.1, 0]) + np.concatenate([np.zeros((1, 3)), around]), np.array([[0, 1, 2], [0, 3, 4]]))
    cell = 0.02
    at = at_rims(bow, flat_surface(), cell)
    np.testing.assert_array_equal(at[0], bow.vertices[0])
    tips = np.linalg.norm(at[1:] - bow.vertices[1:], axis=1)
    assert (tips > 0.5 * cell).all()


def flat_surface():
    """A disc whose local spacing is the same everywhere."""
    samples = shapes.disc(4000)
    up, sure = np.tile([0.0, 0, 1], (len(samples), 1)), np.ones(len(samples))
    return fit_local_surface(samples, up, sure, np.full(len(samples), SPACING), bridge=3.0)


def annulus(outer, inner, rings=8):
    """A flat mesh between two curves round the origin, radii (n,) each, the outer one first."""
    n = len(outer)
    turn = 2 * np.pi * np.arange(n) / n
    radius = np.linspace(outer, inner, rings)
    vertices = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * radius], axis=2).reshape(-1, 3)
    a = np.arange((rings - 1) * n).reshape(rings - 1, n)
    b = np.roll(a, -1, axis=1)
    faces = np.concatenate([np.stack([a, b, b + n], axis=2), np.stack([a, b + n, a + n], axis=2)])
    return Mesh(vertices, faces.reshape(-1, 3).astype(np.int32))


@pytest.mark.parametrize("name", CLOUDS)
def test_no_border_goes_far(pairs, name):
    before, after, spacing, _ = pairs[name]
    rim = np.unique(border(before))
    moved = np.linalg.norm(after.vertices[rim] - before.vertices[rim], axis=1) / spacing[rim]
    assert 0.03 < moved.max() < 1.05 * FARTHEST


@pytest.mark.parametrize("name", CLOUDS)
def test_faces_stay_and_few_are_thin(pairs, name):
    before, after, _, _ = pairs[name]
    np.testing.assert_array_equal(after.faces, before.faces)
    assert (smallest_angles(after) < 10).mean() < 0.04


@pytest.mark.parametrize("name", ["disc", "scattered"])
def test_flat_sheets_have_no_folds(pairs, name):
    after = pairs[name][1]
    (ax, ay), (bx, by), (cx, cy) = (after.vertices[after.faces[:, k], :2].T for k in range(3))
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    assert len(np.unique(np.sign(turn[np.argsort(after.faces.min(axis=1))]))) == 1


def test_corners_are_kept():
    """Those of a square move by a fiftieth of a spacing at most; without reweighting it is more than ten times that."""
    count = 720
    turn = 2 * np.pi * (np.arange(count) + 0.5) / count
    mesh = annulus(0.6 / np.maximum(np.abs(np.cos(turn)), np.abs(np.sin(turn))), 0.3 + 0 * turn)
    after = smooth_rims(mesh, flat_surface(), 0.01)
    assert np.linalg.norm(after.vertices[:count] - mesh.vertices[:count], axis=1).max() < 0.02 * SPACING


def test_vertices_where_sheets_meet_stay(pairs):
    before, after, _, _ = pairs["junction"]
    edges, counts = before.edge_counts()
    meeting = np.unique(edges[counts > 2])
    assert len(meeting) > 20
    np.testing.assert_array_equal(after.vertices[meeting], before.vertices[meeting])


def test_a_closed_mesh_stays():
    run = reconstruct(shapes.sphere(500), Settings(resolution=32, surface="single"))
    samples = run.points
    surface = fit_local_surface(samples, samples, np.ones(len(samples)), local_spacing(samples), bridge=3.0)
    assert smooth_rims(run.sheet, surface, run.field.spacing) is run.sheet
