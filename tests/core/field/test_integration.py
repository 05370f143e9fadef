"""Distances in the whole box, against closed forms and, by libigl, against finely meshed shapes."""

import igl
import numpy as np
import pytest
from scipy.spatial import KDTree

from core import Cancelled, Settings, reconstruct
from core.field.feet import settled_feet
from core.field.grid import fit_grid
from core.field.integration import distance_field
from core.field.local_surface import fit_local_surface
from core.field.projection import FROM_NODES
from core.points import local_spacing
from core.progress import Progress
from tests import shapes


def off(run, true):
    """|u - d| in cells at every node."""
    return np.abs(run.field.values.ravel() - true(shapes.node_positions(run.field))) / run.field.spacing


def scattered_junction(n):
    """Samples uniform on a square and on half of another that stands on its middle line, and their normals."""
    u, v = np.random.default_rng(0).uniform(-1, 1, (2, n))
    upright = np.arange(n) % 3 == 0
    points = np.where(upright[:, None], np.stack([u, 0 * u, abs(v)], axis=1), np.stack([u, v, 0 * u], axis=1))
    return points, np.where(upright[:, None], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])


def moebius_mesh(around=400, across=20, width=0.6):
    """A fine triangle mesh of shapes.moebius, cut open along one line."""
    turn, offset = np.meshgrid(
        np.linspace(0, 2 * np.pi, around + 1), np.linspace(-width / 2, width / 2, across + 1), indexing="ij"
    )
    radius = 1 + offset * np.cos(turn / 2)
    vertices = np.stack([radius * np.cos(turn), radius * np.sin(turn), offset * np.sin(turn / 2)], axis=-1).reshape(
        -1, 3
    )
    corner = (np.arange(around)[:, None] * (across + 1) + np.arange(across)).ravel()
    a, b, c, d = corner, corner + 1, corner + across + 2, corner + across + 1
    return vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


@pytest.mark.parametrize(
    ("run", "true", "mean", "largest"),
    [
        ("sphere_run", shapes.sphere_distance, 0.03, 0.5),
        ("torus_run", shapes.torus_distance, 0.03, 0.5),
        ("disc_run", shapes.disc_distance, 0.15, 1.0),
        ("hemisphere_run", shapes.hemisphere_distance, 0.06, 0.8),
    ],
)
def test_everywhere_in_the_box_u_is_the_distance(run, true, mean, largest, request):
    error = off(request.getfixturevalue(run), true)
    assert error.mean() < mean
    assert error.max() < largest


def test_on_a_moebius_band_u_is_the_distance_to_its_mesh(moebius_run):
    vertices, faces = moebius_mesh()
    error = off(moebius_run, lambda x: np.sqrt(igl.point_mesh_squared_distance(x, vertices, faces)[0]))
    assert error.mean() < 0.1
    assert np.percentile(error, 99) * moebius_run.field.spacing < 0.6 * moebius_run.report["spacing"]


def test_a_hemisphere_does_not_grow_shut(hemisphere_run):
    """Below its open rim u is the distance to the rim, where the paper's diffusion leaves it near zero. The rim
    itself is known to about half a local spacing."""
    hair = 0.6 * hemisphere_run.report["spacing"]
    z = np.linspace(-0.12, 0.6, 40)
    x = np.column_stack([0 * z, 0 * z, z])
    found, true = hemisphere_run.field.sample(x), shapes.hemisphere_distance(x)
    np.testing.assert_allclose(found, true, atol=hair)
    turn = np.linspace(0, 2 * np.pi, 50)
    below = np.column_stack([np.cos(turn), np.sin(turn), np.full(50, -0.12)])
    np.testing.assert_allclose(hemisphere_run.field.sample(below), 0.12, atol=hair)


def test_u_rises_from_a_sample_by_at_most_a_unit_slope(torus_run):
    """A distance is 1-Lipschitz; between neighbouring nodes u changes by hardly more than a cell."""
    values = torus_run.field.values
    for axis in range(3):
        assert np.abs(np.diff(values, axis=axis)).max() < 1.15 * torus_run.field.spacing


def test_between_two_sheets_u_falls_to_zero_at_both(sheets_run):
    x = np.column_stack([np.random.default_rng(0).uniform(-0.7, 0.7, (500, 2)), np.zeros(500)])
    for z, expected in ((0.0, 0.05), (0.05, 0.0), (-0.05, 0.0), (0.15, 0.1)):
        found = sheets_run.field.sample(x + np.array([0, 0, z]))
        np.testing.assert_allclose(found, expected, atol=0.55 * sheets_run.field.spacing)
    between = sheets_run.field.sample(x)
    assert between.min() > 0.4 * 0.05


def test_at_a_junction_u_is_the_distance_to_the_nearest_sheet():
    run = reconstruct(shapes.junction(2000), Settings(resolution=48, surface="none"))

    def true(x):
        beside, above = np.maximum(np.abs(x[:, 1]) - 1, 0), np.maximum(np.maximum(-x[:, 2], x[:, 2] - 1), 0)
        return np.minimum(shapes.square_distance(x), np.linalg.norm([x[:, 0], beside, above], axis=0))

    error = off(run, true)
    assert error.mean() < 0.15
    assert np.percentile(error, 99) < 0.8


@pytest.mark.parametrize(("bridge", "closed"), [(3.0, False), (8.0, True)])
def test_a_hole_narrower_than_bridge_closes_and_a_wider_one_stays_open(bridge, closed):
    radius = 0.16
    points = shapes.holed_square(1000, radius)
    assert 3.0 < 2 * radius / np.median(local_spacing(points)) < 8.0
    run = reconstruct(points, Settings(resolution=48, surface="none", bridge=bridge))
    middle = run.field.sample([[0, 0, 0]])[0]
    if closed:
        assert middle < 0.25 * run.field.spacing
    else:
        assert radius - run.report["spacing"] < middle < radius + 0.5 * run.field.spacing


@pytest.mark.parametrize("resolution", [16, 32])
def test_a_coarse_grid_still_holds_the_distance(resolution):
    run = reconstruct(shapes.sphere(1500), Settings(resolution=resolution, surface="none"))
    assert off(run, shapes.sphere_distance).mean() < 0.05


def test_sparse_samples_are_enough_for_a_smooth_shape():
    run = reconstruct(shapes.sphere(150), Settings(resolution=48, surface="none"))
    assert off(run, shapes.sphere_distance).mean() < 0.1


class TestAlone:
    """The stage by itself, given true normals."""

    @pytest.fixture
    def stage(self):
        points = shapes.sphere(400)
        return fit_local_surface(points, points, np.ones(len(points)), local_spacing(points), 3.0), fit_grid(points, 32)

    def test_gives_a_value_at_every_node(self, stage):
        surface, grid = stage
        values, _ = distance_field(surface, grid)
        assert (values.shape, values.dtype) == (grid.shape, np.float32)
        x = grid.positions(np.arange(values.size))
        assert (values.ravel() <= KDTree(surface.points).query(x)[0] + 0.5 * grid.spacing).all()
        np.testing.assert_allclose(values.ravel(), shapes.sphere_distance(x), atol=0.5 * grid.spacing)

    def test_near_the_surface_it_is_the_projection_distance(self, stage):
        surface, grid = stage
        values, _ = distance_field(surface, grid)
        near = np.flatnonzero(values < grid.spacing)
        projected = surface.project(grid.positions(near), nearest=FROM_NODES).distance
        np.testing.assert_allclose(values.flat[near], projected, atol=1e-6)

    def test_nowhere_is_it_more_than_to_a_foot(self):
        """Where sheets meet, patches do not quite, and projections between them are too long."""
        points, normals = scattered_junction(1500)
        surface = fit_local_surface(points, normals, np.ones(len(points)), local_spacing(points), 3.0)
        grid = fit_grid(points, 80)
        values, near = distance_field(surface, grid)
        projected = surface.project(grid.positions(near.node), nearest=FROM_NODES)
        _, feet = settled_feet(surface, grid, near.node, projected, Progress())
        found, bound = values.flat[near.node], feet.nearest(grid.positions(near.node) - grid.origin)[0]
        away = found > 0.7 * grid.spacing
        assert ((found - bound)[away] < 0.2 * grid.spacing).all()
        assert ((projected.distance - bound)[away] > 0.3 * grid.spacing).sum() > 20

    def test_reports_in_order_and_stops_when_told(self, stage):
        seen = []
        distance_field(*stage, progress=lambda fraction, _: seen.append(fraction))
        assert seen == sorted(seen)
        assert 0 <= seen[0] <= seen[-1] <= 1
        with pytest.raises(Cancelled):
            distance_field(*stage, progress=lambda fraction, _: fraction < seen[-1])


@pytest.mark.parametrize("band", [None, 4])
def test_steps_from_the_surface_are_as_long_as_the_distances(band):
    """Between patches that do not quite meet, too, where those of projections are longer."""
    points = np.random.default_rng(1).normal(size=(600, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    field = reconstruct(points, Settings(resolution=64, band=band, surface="none")).field
    x = field.origin + field.spacing * np.stack(np.unravel_index(field.near.node, field.shape), axis=1)
    values = field.values.flat[field.near.node]
    np.testing.assert_allclose(np.linalg.norm(field.near.step, axis=1), values, atol=1e-3 * field.spacing)
    np.testing.assert_allclose(field.sample(x), values, atol=1e-3 * field.spacing)
    assert np.abs(shapes.sphere_distance(x - field.near.step)).max() < field.spacing


@pytest.mark.parametrize("diffusion", ["kernel", "grid"])
@pytest.mark.parametrize("resolution", [24, 25])
def test_poisson_is_as_good_on_all_sides_of_the_box(resolution, diffusion):
    """With an odd number of cells, too, which the grid of every second node does not divide."""
    settings = Settings(resolution=resolution, surface="none", integration="poisson", diffusion=diffusion)
    field = reconstruct(shapes.sphere(300), settings).field
    x = field.origin + field.spacing * np.indices(field.values.shape).reshape(3, -1).T
    off = np.abs(field.values.reshape(-1) - np.abs(np.linalg.norm(x, axis=1) - 1)) / field.spacing
    off = off.reshape(field.values.shape)
    for axis in range(3):
        low, high = (np.take(off, side, axis=axis).mean() for side in (0, -1))
        assert max(low, high) < 1.5 * min(low, high) + 0.02


@pytest.mark.parametrize("points", [shapes.sphere(800), shapes.hemisphere(800)], ids=["sphere", "hemisphere"])
def test_poisson_agrees_with_transport(points):
    """Two routes to the same distance: they part by less than a cell except around the medial axis."""
    run, other = (
        reconstruct(points, Settings(resolution=48, surface="none", integration=how))
        for how in ("transport", "poisson")
    )
    apart = np.abs(run.field.values - other.field.values) / run.field.spacing
    assert 0 < apart.mean() < 0.4
    assert np.percentile(apart, 95) < 1.0
    near = run.field.values < run.field.spacing
    assert np.mean(run.field.values[near] == other.field.values[near]) > 0.998  # but where feet close a crack


def test_poisson_is_nowhere_farther_than_the_nearest_sample():
    points = shapes.hemisphere(500)
    field = reconstruct(points, Settings(resolution=32, integration="poisson", surface="none")).field
    nodes = field.origin + field.spacing * np.stack(np.indices(field.values.shape), axis=-1)
    farthest = KDTree(points).query(nodes[::2, ::2, ::2])[0]
    assert ((field.values[::2, ::2, ::2] - farthest) / field.spacing).max() < 1e-4
