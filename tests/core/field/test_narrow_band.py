"""The field of a narrow band is that of the whole box, as far as it goes."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from core import BandedField, Cancelled, DistanceField, Settings, VADError, reconstruct
from core.field.grid import Grid, fit_grid
from core.field.integration import BAND, distance_field
from core.field.local_surface import fit_local_surface
from core.field.narrow_band import banded_field, trimmed
from core.points import local_spacing
from core.surface.extract import band_for
from tests import shapes

CELLS = 4.0


def local_surface(points, normals):
    return fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)


@pytest.fixture(scope="module")
def ball():
    points = shapes.sphere(1500)
    return local_surface(points, points)


@pytest.fixture(scope="module")
def banded():
    """Runs beside those in the whole box: name -> run."""
    return {
        "sphere": reconstruct(shapes.sphere(1500), Settings(resolution=48, band=CELLS)),
        "hemisphere": reconstruct(shapes.hemisphere(1500), Settings(resolution=48, band=CELLS, surface="both")),
        "signed": reconstruct(shapes.sphere(800), Settings(resolution=32, band=3, surface="signed")),
    }


@pytest.mark.parametrize("points", [shapes.sphere(800), shapes.sheets(1600, 0.3)])
def test_values_are_those_of_the_whole_box(points):
    run, whole = (reconstruct(points, Settings(resolution=40, band=b, surface="none")) for b in (CELLS, None))
    cell = whole.field.spacing
    np.testing.assert_array_equal(run.field.near.node, whole.field.near.node)
    found, expected = run.field.values, whole.field.values
    assert (found.shape, found.dtype) == (expected.shape, np.float32)
    np.testing.assert_array_equal(found.flat[run.field.near.node], expected.flat[run.field.near.node])
    off = np.abs(found - np.minimum(expected, run.field.band)) / cell
    assert off.mean() < 0.02
    assert np.mean(off > 0.15) < 0.01
    assert off.max() < 0.75
    assert found.max() == np.float32(run.field.band)
    assert run.field.band == pytest.approx(CELLS * cell)


def test_double_cover_and_single_layer_are_those_of_the_whole_box(banded, hemisphere_run):
    found, expected = banded["hemisphere"].surface, hemisphere_run.surface
    off = KDTree(expected.vertices).query(found.vertices)[0] / hemisphere_run.field.spacing
    assert len(found.vertices) == pytest.approx(len(expected.vertices), rel=0.001)
    assert off.max() < 0.25
    assert np.mean(off < 1e-3) > 0.99
    whole = reconstruct(shapes.hemisphere(1500), Settings(resolution=48, surface="single"))
    np.testing.assert_array_equal(banded["hemisphere"].sheet.faces, whole.sheet.faces)
    np.testing.assert_allclose(banded["hemisphere"].sheet.vertices, whole.sheet.vertices, atol=1e-9)


def test_signs_are_those_of_the_whole_box_even_far_inside(banded):
    whole = reconstruct(shapes.sphere(800), Settings(resolution=32, surface="signed"))
    run = banded["signed"]
    assert run.field.sdf
    np.testing.assert_array_equal(run.field.values < 0, whole.field.values < 0)
    np.testing.assert_array_equal(run.surface.faces, whole.surface.faces)
    x = np.array([[0, 0, 0], [0, 0, 0.97], [0, 1.2, 0], [3, 0, 0]])
    np.testing.assert_allclose(run.field.sample(x), [-1, -0.03, 0.2, 2], atol=0.03)


def test_a_bridged_opening_is_spanned_as_in_the_whole_box():
    """A ball without its cap: the sides differ across the opening, further from the surface than the band."""
    points = shapes.sphere(1200)
    points = points[points[:, 2] < 0.93]
    run, whole = (
        reconstruct(points, Settings(resolution=40, band=b, surface="signed", bridge=9, outliers=False, denoise=0.0))
        for b in (3, None)
    )
    assert np.mean((run.field.values < 0) != (whole.field.values < 0)) < 1e-4
    off = KDTree(whole.surface.vertices).query(run.surface.vertices)[0]
    assert np.mean(off < 1e-6) > 0.97
    assert set(run.surface.edge_counts()[1]) == {2}
    assert run.surface.vertices[:, 2].max() > 0.9


@pytest.mark.parametrize("kind", ["none", "double", "single", "both", "signed"])
def test_surfaces_take_distances_beyond_the_band(ball, kind):
    """Where sides are told apart, regions start at up to half the bridging length; their neighbours are looked at, too.
    The double cover of samples far apart takes those two cells beyond its level."""
    grid = fit_grid(ball.points, 88)
    spacing = np.median(ball.spacing) / grid.spacing
    assert 3.3 < spacing < 3.9
    found = band_for(Settings(band=3, surface=kind), ball, grid)
    if kind == "none":
        assert found == 3
    else:
        assert 1.5 * spacing + 1 < found < 1.5 * spacing + 2
    assert band_for(Settings(band=12, surface=kind), ball, grid) == 12
    finer = fit_grid(ball.points, 144)
    spacing *= grid.spacing / finer.spacing
    assert 5.4 < spacing < 6.4
    if kind == "double":
        found = band_for(Settings(band=3, surface=kind), ball, finer)
        assert found == pytest.approx(1 + 0.5 * (spacing - 3) + 2)


def test_sampling_is_that_of_the_whole_box_in_and_out_of_the_band(banded, sphere_run, random):
    x = random.uniform(-1.2, 1.2, (4000, 3))
    run = banded["sphere"]
    off = np.abs(run.field.sample(x) - sphere_run.field.sample(x)) / sphere_run.field.spacing
    assert off.mean() < 0.05
    true = shapes.sphere_distance(x)
    assert np.abs(run.field.sample(x) - true).mean() < 0.1 * run.field.spacing
    away = np.abs(true) > 0.02
    steep = np.linalg.norm(run.field.gradient(x[away & (np.linalg.norm(x, axis=1) > 0.2)]), axis=1)
    assert np.percentile(np.abs(steep - 1), 95) < 0.2
    outside = np.array([[3, 0, 0], [0, -2, 5]])
    expected = sphere_run.field.sample(outside)
    np.testing.assert_allclose(run.field.sample(outside), expected, atol=0.1 * run.field.spacing)


def test_there_is_no_step_at_the_end_of_the_band(banded):
    field = banded["sphere"].field
    radius = 1 + np.linspace(0.5, 1.5, 2000) * field.band
    for direction in np.eye(3):
        along = field.sample(radius[:, None] * direction)
        assert np.abs(np.diff(along)).max() < 0.1 * field.spacing
        np.testing.assert_allclose(along, radius - 1, atol=0.15 * field.spacing)


def test_a_field_says_what_it_is(banded):
    field = banded["sphere"].field
    assert isinstance(field, BandedField)
    assert field.shape == field.values.shape
    assert field.blocks.size < 0.8 * np.prod(field.shape)
    assert field.sample(np.empty((0, 3))).shape == (0,)
    assert banded["sphere"].report["counts"]["nodes"] >= field.blocks.size
    assert banded["sphere"].report["settings"]["band"] == CELLS


def test_a_billion_nodes_cost_what_the_surface_costs(ball):
    """A small ball in a box of 1001^3 nodes, whose values would take 4 GB."""
    grid = Grid(np.full(3, -50.0), 0.1, (1001, 1001, 1001))
    values, near, feet = banded_field(ball, grid, CELLS)
    assert values.stored.nbytes < 2**20
    x = grid.positions(near.node)
    np.testing.assert_allclose(values.at(near.node), shapes.sphere_distance(x), atol=0.02)
    assert shapes.sphere_distance(x).max() <= (BAND + 0.1) * grid.spacing
    field = BandedField(values, grid.origin, grid.spacing, CELLS * grid.spacing, False, feet.in_cells(grid))
    np.testing.assert_allclose(field.sample([[0, 0, 20], [0, 0, 1.1], [-49, 0, 0]]), [19, 0.1, 48], atol=0.02)
    with pytest.raises(VADError, match=r"1003003001 nodes.*sample"):
        _ = field.values


def test_sparse_samples_keep_every_node_of_the_band():
    """Patches reach further than the band is wide."""
    points = shapes.sphere(60)
    surface, grid = local_surface(points, points), fit_grid(points, 40)
    values, near, _ = banded_field(surface, grid, 3.0)
    whole, expected = distance_field(surface, grid)
    missed = np.setxor1d(near.node, expected.node)
    assert len(missed) < 0.003 * len(near.node)
    off = np.abs(values.dense() - np.minimum(whole, np.float32(3 * grid.spacing)))
    assert off.mean() < 0.05 * grid.spacing


def test_a_surface_at_the_side_of_the_box_stays_in_it(ball):
    grid = Grid(np.full(3, -1.05), 0.1, (22, 22, 22))
    values, near, _ = banded_field(ball, grid, 6.0)
    whole, expected = distance_field(ball, grid)
    np.testing.assert_array_equal(near.node, expected.node)
    np.testing.assert_allclose(values.dense(), np.minimum(whole, np.float32(0.6)), atol=0.05)


def test_trimming_cuts_off_and_stores_less(ball):
    grid = fit_grid(ball.points, 48)
    wide, narrow = banded_field(ball, grid, 8.0)[0], banded_field(ball, grid, 3.0)[0]
    cut = trimmed(wide, 3.0 * grid.spacing)
    assert cut.size < wide.size
    assert (wide.stored < np.float32(8.0 * grid.spacing)).any(axis=(1, 2, 3)).all()
    np.testing.assert_allclose(cut.dense(), narrow.dense(), atol=1e-6)


def test_reports_in_order_and_stops_when_told(ball):
    seen = []
    grid = fit_grid(ball.points, 40)
    banded_field(ball, grid, CELLS, progress=lambda fraction, _: seen.append(fraction))
    assert seen == sorted(seen)
    assert 0 <= seen[0] <= seen[-1] <= 1
    with pytest.raises(Cancelled):
        banded_field(ball, grid, CELLS, progress=lambda fraction, _: fraction < seen[-1])


def test_the_whole_box_stays_the_default(sphere_run):
    assert Settings().band is None
    assert isinstance(sphere_run.field, DistanceField)
    assert sphere_run.field.band == np.inf
