"""Parts of meshes that span openings, by closed form."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.double.spanning import spanned, spanning_vertices, stretched_vertices
from tests import shapes

SIDE = 21
AT = np.stack(np.meshgrid(*[np.linspace(-1, 1, SIDE)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
CORNER = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1)
QUADS = np.stack([CORNER, CORNER + SIDE, CORNER + SIDE + 1, CORNER + 1], axis=1)
TRIANGLES = np.concatenate([QUADS[:, :3], QUADS[:, [0, 2, 3]]])
LOOSE = np.linalg.norm(AT, axis=1) < 0.6


@pytest.mark.parametrize("faces", [QUADS, TRIANGLES])
def test_a_torn_plane_is_made_whole(faces):
    plane = AT @ [[1.0, 0.0, 0.5], [0.0, 1.0, -0.3]]
    torn = plane + LOOSE[:, None] * np.random.default_rng(0).normal(size=plane.shape)
    np.testing.assert_allclose(spanned(torn, faces, LOOSE), plane, atol=1e-3)
    np.testing.assert_array_equal(spanned(torn, faces, LOOSE)[~LOOSE], plane[~LOOSE])


def test_a_dome_goes_on_as_it_comes_and_is_not_cut_off():
    dome = np.column_stack([AT, np.sqrt(4 - (AT**2).sum(axis=1))])
    flat = dome * [1, 1, 0] + [0, 0, np.sqrt(4 - 0.6**2)]
    found = spanned(np.where(LOOSE[:, None], flat, dome), QUADS, LOOSE)
    assert np.abs(flat - dome)[LOOSE].max() > 0.09
    assert np.abs(found - dome)[LOOSE].max() < 0.01


def test_what_nothing_holds_stays_and_so_does_all_without_openings():
    plane = np.column_stack([AT, np.zeros(len(AT))])
    np.testing.assert_array_equal(spanned(plane, QUADS, np.zeros(len(AT), bool)), plane)
    bent = plane + [[0.0, 0.0, 1.0]] * AT[:, :1] ** 2
    found = spanned(bent, QUADS, np.ones(len(AT), bool))
    np.testing.assert_allclose(found.mean(axis=0), bent.mean(axis=0), atol=1e-6)
    assert np.abs(found).max() < 1.2


def test_vertices_closer_to_openings_than_to_the_surface_span_them_and_rims_beside():
    x = shapes.sphere(2000)
    places, radius, level = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]]), np.linspace(0, 1, 2000), 0.15
    turned = np.random.default_rng(0).permutation(2000)
    step, past_rim = x[turned] * radius[turned, None], np.arange(2000) % 3 == 0
    away = np.linalg.norm(x[:, None] - places, axis=2).min(axis=1)
    found = spanning_vertices(x, step, past_rim, places, level)
    np.testing.assert_array_equal(found, (away < radius[turned]) | (past_rim & (away < 0.3)))
    assert not spanning_vertices(x, step, past_rim, np.empty((0, 3)), level).any()


def test_vertices_drawn_out_to_another_sheet_are_found_and_long_faces_on_a_sheet_are_not():
    """Two sheets five cells apart, covered alone the lower one; one of its vertices is on the upper one, and one four
    cells along its own."""
    sheet = np.column_stack([AT, np.zeros(len(AT))])
    points = np.concatenate([sheet, sheet + np.array([0, 0, 0.5])])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    surface = fit_local_surface(points, up, np.ones(len(points)), local_spacing(points), 3.0)
    middle, aside = 10 * SIDE + 10, 5 * SIDE + 5
    vertices = sheet.copy()
    vertices[middle] += [0, 0, 0.5]
    vertices[aside] += [0, -0.4, 0]
    around = middle + np.array([-SIDE, -1, 0, 1, SIDE])
    np.testing.assert_array_equal(np.flatnonzero(stretched_vertices(vertices, QUADS, surface, 0.1)), around)
    assert not stretched_vertices(sheet, QUADS, surface, 0.1).any()


def test_covers_of_few_samples_are_drawn_out_less_from_sheet_to_sheet():
    """Of sixty samples of a torus edges were up to 15 cells long."""
    result = reconstruct(shapes.torus(60), Settings(resolution=64, denoise=0))
    mesh = result.surface
    length = np.linalg.norm(mesh.vertices[mesh.edges.low] - mesh.vertices[mesh.edges.high], axis=1)
    assert length.max() < 10 * result.field.spacing
