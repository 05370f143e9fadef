"""Folded faces, where the mesh should be a height field, convex or flat, so that projected areas tell them."""

from dataclasses import replace

import numpy as np
import pytest

from core import Mesh, Settings, fit_local_surface, reconstruct
from core.points import local_spacing
from core.surface.meshing.triangles import mesh_of
from core.surface.meshing.unfolding import unfolded
from tests import shapes

SIDE, UP = 12, [0.0, 0.0, 1.0]
MIDDLE = (SIDE // 2) * (SIDE + 1) + SIDE // 2  # the vertex in the middle of the square


@pytest.fixture(scope="module")
def plane():
    """A local surface, the plane z = 0 beyond the square."""
    points = shapes.square(3000, 24.0) + np.array([6.0, 6.0, 0.0])
    normals = np.tile(UP, (len(points), 1))
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


def square() -> Mesh:
    """Quads with sides of 1, in the plane."""
    x, y = np.meshgrid(np.arange(SIDE + 1.0), np.arange(SIDE + 1.0), indexing="ij")
    corner = np.arange(x.size).reshape(x.shape)
    quads = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=2).reshape(-1, 4)
    return mesh_of(np.stack([x, y, np.zeros_like(x)], axis=2).reshape(-1, 3), quads)


def moved(mesh, vertex, place) -> Mesh:
    vertices = mesh.vertices.copy()
    vertices[vertex] = place
    return replace(mesh, vertices=vertices)


def areas_from_above(mesh):
    """(f,), negative where a face lies on its back."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)[:, 2]


def test_vertices_that_went_past_others_come_back(plane):
    mesh = moved(square(), MIDDLE, [7.6, 6.3, 0.0])
    assert (areas_from_above(mesh) < 0).any()
    found = unfolded(mesh, plane, 1.0)
    assert (areas_from_above(found) > 0).all()
    assert found.pairs == mesh.pairs
    assert np.abs(found.vertices[:, 2]).max() < 1e-9
    far = np.linalg.norm(mesh.vertices - mesh.vertices[MIDDLE], axis=1) > 6
    kept = {tuple(x) for x in found.vertices.round(9).tolist()}
    assert {tuple(x) for x in mesh.vertices[far].round(9).tolist()} <= kept
    _, counts = found.edge_counts()
    assert (counts == 1).sum() == 4 * SIDE


def test_a_vertex_that_is_held_stays_and_others_make_room(plane):
    mesh = moved(square(), MIDDLE, [7.3, 6.2, 0.0])
    assert (areas_from_above(mesh) < 0).any()
    held = np.zeros(len(mesh.vertices), bool)
    held[MIDDLE] = True
    found = unfolded(mesh, plane, 1.0, held)
    assert (areas_from_above(found) > 0).all()
    assert np.linalg.norm(found.vertices - [7.3, 6.2, 0], axis=1).min() == 0


@pytest.mark.parametrize("to_inside", [False, True])
def test_faces_at_a_border_that_lie_on_others_go(plane, to_inside):
    """Over the border from (0,0) to (1,0), back over the square, and on to an edge inside, which then has three."""
    mesh = square()
    start, end, inside, tip = 0, SIDE + 1, SIDE + 2, len(mesh.vertices)
    flap = np.array([[end, start, tip], [tip, inside, end]])[: 1 + to_inside]
    faces = np.concatenate([mesh.faces, flap]).astype(np.int32)
    spoiled = Mesh(np.vstack([mesh.vertices, [0.5, 0.4, 0.0]]), faces, mesh.pairs)
    assert (spoiled.edge_counts()[1] == 3).sum() == to_inside
    assert (areas_from_above(spoiled) < 0).any()
    found = unfolded(spoiled, plane, 1.0)
    assert (areas_from_above(found) > 0).all()
    assert len(found.faces) == len(mesh.faces)
    assert found.border_loops() == 1
    assert set(found.edge_counts()[1]) == {1, 2}
    assert found.pairs == mesh.pairs


def test_vertices_of_a_line_change_places_along_it(plane):
    flat = square()
    upright = flat.vertices[:, [2, 1, 0]] + [6, 0, 0]
    line = flat.vertices[:, 0] == 6
    row = np.where(
        upright[:, 2] == 0,
        np.flatnonzero(line)[upright[:, 1].astype(int)],
        len(flat.vertices) + np.arange(len(upright)),
    )
    mesh = flat.joined(replace(flat, vertices=upright))
    joined = np.append(np.arange(len(flat.vertices)), row)[mesh.faces]
    mesh = Mesh(mesh.vertices, joined.astype(np.int32), mesh.pairs)
    mesh = moved(mesh, np.flatnonzero(line)[[6, 7]], [[6, 7.2, 0], [6, 5.8, 0]])
    found = unfolded(mesh, plane, 1.0)
    edges, counts = found.edge_counts()
    ends = found.vertices[edges[counts > 2]]
    assert (counts > 2).sum() == SIDE
    np.testing.assert_allclose(ends[..., [0, 2]], np.broadcast_to([6, 0], (SIDE, 2, 2)), atol=1e-9)
    assert np.abs(np.diff(ends[..., 1], axis=1)).sum() == pytest.approx(SIDE)  # no way is gone twice
    assert (areas_from_above(found)[np.abs(found.vertices[found.faces][..., 2]).max(axis=1) < 1e-9] > 0).all()


def test_the_fold_of_a_sheet_is_left_as_it_is(plane):
    """Two halves, a finger's width apart at the far side: no face of it is between folds."""
    mesh = square()
    x, y, _ = mesh.vertices.T
    folded = replace(mesh, vertices=np.stack([np.abs(x - 6), y, 0.1 * np.maximum(x - 6, 0)], axis=1))
    assert unfolded(folded, plane, 1.0) is folded


def test_without_folds_the_mesh_is_the_same(plane):
    mesh = square()
    assert unfolded(mesh, plane, 1.0) is mesh


def wave():
    x = np.random.default_rng(0).uniform(-1, 1, (4000, 2))
    return np.column_stack([x, 0.12 * np.sin(14 * x[:, 0])])


def test_a_height_field_has_no_face_on_its_back():
    run = reconstruct(wave(), Settings(surface="single", resolution=48, denoise=0))
    area = areas_from_above(run.sheet)
    area *= np.sign(area.sum())
    assert np.maximum(-area, 0).sum() < 0.01 * run.field.spacing**2


def test_no_face_of_a_box_looks_inwards():
    run = reconstruct(shapes.scattered_box(2000, (1, 1, 1)), Settings(surface="signed", resolution=64, denoise=0))
    mesh = run.surface
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), mesh.vertices.mean(axis=0) - a) > 0
    assert mesh.face_areas()[inwards].sum() < 0.01 * run.field.spacing**2
