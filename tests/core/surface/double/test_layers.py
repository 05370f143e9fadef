"""Layers of a double cover, by closed form on balls and folds; the search for the other one by a second, slow one."""

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

from core import Cancelled, Mesh, Settings, reconstruct
from core.progress import Progress
from core.surface.double.layers import _other_layer, laid_apart
from core.surface.meshing.triangles import mesh_of
from tests import shapes
from tests.core.surface.meshing.test_centring import ball
from tests.core.surface.meshing.test_evening import SIDE, uneven


def both(outer, inner):
    """One mesh of two, the second turned inside out."""
    faces = np.concatenate([outer.faces, inner.faces[:, ::-1] + len(outer.vertices)])
    return Mesh(np.concatenate([outer.vertices, inner.vertices]), faces.astype(np.int32))


def on_faces(mesh):
    """Corners, middles of edges and centroids."""
    vertices, low, high = mesh.vertices, mesh.edges.low, mesh.edges.high
    return np.concatenate([vertices, 0.5 * (vertices[low] + vertices[high]), vertices[mesh.faces].mean(axis=1)])


def test_each_layer_of_a_ball_is_on_its_own_side():
    outer, inner = ball(24), ball(17)
    count = len(outer.vertices)
    apart = laid_apart(both(outer, inner), 0.06)
    outer, inner = (
        Mesh(apart.vertices[rows], apart.faces[(apart.faces[:, 0] < count) == first] - rows.start)
        for first, rows in ((True, slice(0, count)), (False, slice(count, len(apart.vertices))))
    )
    assert np.linalg.norm(on_faces(outer), axis=1).min() > 1 - 1e-4
    assert np.linalg.norm(on_faces(inner), axis=1).max() < 1 + 1e-4
    assert np.abs(np.linalg.norm(apart.vertices, axis=1) - 1).max() < 0.003  # edges of .07 to .1 dip that much


def test_stops_when_told_while_it_looks_for_the_other_layer():
    vertices, quads = uneven(lambda x, y: 0.7 * np.abs(x - SIDE / 2))
    looks = []
    with pytest.raises(Cancelled):
        laid_apart(mesh_of(vertices, quads), 1.0, lambda fraction, _: looks.append(fraction) or fraction < 0.4)
    assert looks[-1] >= 0.4


def test_a_fold_that_pokes_through_the_other_layer_is_taken_back():
    vertices, quads = uneven(lambda x, y: 0.7 * np.abs(x - SIDE / 2))
    sheet = mesh_of(vertices, quads)
    poking = Mesh(vertices + np.array([0, 0, 0.2]), sheet.faces)
    ridge = vertices[:, 0] == SIDE / 2
    up = laid_apart(both(sheet, poking), 1.0).vertices[:, 2]
    above, below = up[: len(ridge)][ridge], up[len(ridge) :][ridge]
    assert (above - below).min() > -0.05
    np.testing.assert_allclose(0.5 * (above + below), 0.1, atol=0.02)


def test_flat_layers_with_other_foot_points_are_taken_back_to_their_sides():
    """The outer one is lower than the inner one in the middle, by a tenth of a cell at most, and bends nowhere."""

    def lower(x, y):
        return -0.1 * np.exp(-((x - SIDE / 2) ** 2 + (y - SIDE / 2) ** 2) / 4)

    (inner, quads), (outer, _) = uneven(lambda x, y: 0 * x), uneven(lower, seed=1)
    apart = both(mesh_of(outer, quads), mesh_of(inner, quads))
    before, after = (at.reshape(2, -1, 3) for at in (apart.vertices, laid_apart(apart, 1.0).vertices))
    within = np.linalg.norm(outer[:, :2] - SIDE / 2, axis=1) < 4

    def lowest(layers):
        under = LinearNDInterpolator(layers[1][:, :2], layers[1][:, 2])
        return (layers[0][within, 2] - under(layers[0][within, :2])).min()

    assert lowest(before) < -0.08
    assert lowest(after) > -0.01


def test_the_other_layer_is_found_as_by_trying_every_face():
    mesh, cell = both(ball(9), ball(7)), 0.2
    random = np.random.default_rng(0)
    place = random.normal(size=(300, 3))
    place /= np.linalg.norm(place, axis=1, keepdims=True)
    outward = place * np.where(random.random(300) < 0.5, 1, -1)[:, None]
    behind, face = _other_layer(mesh, place, outward, cell, Progress())
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    for at, way, found, which in zip(place, outward, behind, face, strict=True):
        depth = np.einsum("fi,fi->f", at - a, normal) / (normal @ way)
        hit = (normal @ way < 0) & (np.abs(depth) < 0.5 * cell)
        share = np.linalg.solve(np.stack([b - a, c - a, np.broadcast_to(way, a.shape)], axis=2), (at - a)[:, :, None])[
            :, :, 0
        ]
        hit &= (share[:, :2] >= 0).all(axis=1) & (share[:, 0] + share[:, 1] <= 1)
        assert np.flatnonzero(hit).tolist() == [which]
        assert found == pytest.approx(depth[which], abs=1e-12)


def test_without_another_layer_nothing_is_cleared():
    behind, _ = _other_layer(ball(6), np.eye(3), np.eye(3), 0.2, Progress())
    assert np.isinf(behind).all()


def crossed(run):
    """Share of the double cover's area whose other layer is in front."""
    mesh = run.surface
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    behind, _ = _other_layer(mesh, (a + b + c) / 3, normal, run.field.spacing, Progress())
    assert np.isfinite(behind).mean() > 0.9
    return ((behind < 0) * mesh.face_areas()).sum() / mesh.face_areas().sum()


@pytest.mark.usefixtures("at_offset")
@pytest.mark.parametrize("points", [shapes.torus(3000), shapes.disc(1500), shapes.junction(3000)], ids=len)
def test_layers_of_a_double_cover_hardly_cross(points):
    assert crossed(reconstruct(points, Settings(resolution=48))) < 0.015


@pytest.mark.usefixtures("at_offset")
def test_samples_denser_than_the_cells_have_faces_astride():
    run = reconstruct(shapes.sphere(20_000), Settings(resolution=32))
    assert run.report["spacing"] < 0.6 * run.field.spacing
    assert crossed(run) > 0.2
