import doctest
import importlib
import json
from dataclasses import asdict, replace
from pathlib import Path

import igl
import numpy as np
import pytest
from plyfile import PlyData
from scipy.spatial import KDTree

from core import Cancelled, DistanceField, InputError, Mesh, Settings, reconstruct
from core.points import local_spacing
from core.surface.meshing.quality import quad_quality, triangle_quality
from tests import shapes

DATA = Path(__file__).parents[1] / "data"
SMALL = Settings(resolution=24)
FIELD_ONLY = Settings(resolution=24, surface="none")
EYE = np.eye(3)


@pytest.fixture(scope="module")
def mask():
    """Real data: points, true vertices and true faces."""
    truth = PlyData.read(DATA / "mask_truth.ply")
    faces = np.vstack(truth["face"]["vertex_indices"]).astype(np.int64)
    return vertices(PlyData.read(DATA / "mask.ply")), vertices(truth), faces


@pytest.fixture(scope="module")
def mask_run(mask):
    return reconstruct(mask[0], Settings(resolution=80))


@pytest.fixture(scope="module")
def points():
    """A torus on a dyadic lattice, so that shifts by whole numbers are exact."""
    return np.rint(shapes.torus(700) * 2**20) / 2**20


@pytest.fixture(scope="module")
def here(points):
    return reconstruct(points, SMALL)


@pytest.fixture(scope="module")
def calls():
    """What a whole run reports."""
    seen = []
    reconstruct(shapes.sphere(300), SMALL, progress=lambda *call: seen.append(call))
    return seen


def distinct(calls):
    """Without the repeats of a call that fill silences."""
    return [call for call, before in zip(calls, [None, *calls[:-1]], strict=True) if call != before]


def vertices(ply):
    return np.stack([ply["vertex"][axis] for axis in "xyz"], axis=1).astype(np.float64)


def cosines(a, b):
    return np.abs(np.einsum("ni,ni->n", a, b))


def arrays(result):
    yield from (result.points, result.source_index, result.normals, result.confidence, result.field.values)
    yield from (result.field.origin, np.float64(result.field.spacing), result.surface.vertices, result.surface.faces)


@pytest.mark.parametrize("module", ["core.pipeline", "core.progress"])
def test_examples_in_the_docstrings_hold(module):
    failed, tried = doctest.testmod(importlib.import_module(module))
    assert (failed, tried > 0) == (0, True)


class TestResult:
    def test_holds_what_the_contract_says(self, sphere_run):
        n = 1500
        assert (sphere_run.points.shape, sphere_run.points.dtype) == ((n, 3), np.float64)
        assert (sphere_run.source_index.shape, sphere_run.source_index.dtype) == ((n,), np.int64)
        assert (sphere_run.normals.shape, sphere_run.normals.dtype) == ((n, 3), np.float64)
        assert (sphere_run.confidence.shape, sphere_run.confidence.dtype) == ((n,), np.float64)
        assert isinstance(sphere_run.field, DistanceField)
        assert sphere_run.field.values.dtype == np.float32
        assert sphere_run.field.values.ndim == 3
        assert (sphere_run.field.origin.shape, sphere_run.field.origin.dtype) == ((3,), np.float64)
        assert isinstance(sphere_run.field.spacing, float)
        assert not sphere_run.field.sdf
        assert isinstance(sphere_run.surface, Mesh)
        assert (sphere_run.surface.vertices.dtype, sphere_run.surface.faces.dtype) == (np.float64, np.int32)

    def test_axes_are_unit_and_right_and_sure_on_a_sphere(self, sphere_run):
        np.testing.assert_allclose(np.linalg.norm(sphere_run.normals, axis=1), 1, atol=1e-12)
        assert cosines(sphere_run.normals, sphere_run.points).min() > 0.9999
        assert 0 <= sphere_run.confidence.min() <= sphere_run.confidence.max() <= 1
        assert sphere_run.confidence.mean() > 0.99

    def test_confidence_is_lower_where_points_are_noise(self, sphere_run, random):
        ball = random.uniform(-1, 1, (500, 3))
        assert reconstruct(ball, replace(FIELD_ONLY, denoise=0)).confidence.mean() < sphere_run.confidence.mean() - 0.1

    def test_the_box_holds_the_object_with_a_margin(self, sphere_run):
        field = sphere_run.field
        assert max(field.values.shape) == 48 + 1
        high = field.origin + field.spacing * (np.array(field.values.shape) - 1)
        assert (field.origin < -1.1).all()
        assert (high > 1.1).all()

    def test_report_is_json_and_tells_the_run(self, sphere_run):
        report = json.loads(json.dumps(sphere_run.report, allow_nan=False))
        assert report == sphere_run.report
        assert report["settings"] == asdict(Settings(resolution=48))
        assert report["counts"]["input"] == report["counts"]["samples"] == 1500
        assert report["counts"]["nodes"] == sphere_run.field.values.size
        mesh = sphere_run.surface
        counts = {"vertices": len(mesh.vertices), "faces": len(mesh.faces), "borders": 0}
        counts |= {"pieces": 2, "pieces_dropped": 0, "nonmanifold_edges": 0}
        assert report["meshes"] == {"double": {**counts, **triangle_quality(mesh), **quad_quality(mesh)}}
        assert {"points", "normals", "field", "surface"} <= report["seconds"].keys()
        assert all(seconds >= 0 for seconds in report["seconds"].values())
        assert report["spacing"] == pytest.approx(np.median(local_spacing(sphere_run.points)))
        assert report["grid"]["cell"] == sphere_run.field.spacing
        assert report["warnings"] == []

    def test_dropped_rows_are_counted_and_the_rest_is_traced(self):
        points = np.concatenate(
            [shapes.sphere(200), shapes.sphere(3), [[np.nan] * 3], shapes.sphere(200), [[np.inf] * 3]]
        )
        result = reconstruct(points.tolist(), FIELD_ONLY)
        np.testing.assert_array_equal(result.source_index, np.arange(203))
        np.testing.assert_array_equal(result.points, points[result.source_index])
        assert result.report["counts"]["input"] == 405
        assert result.report["counts"]["samples"] == 203
        assert ["2 of 405" in result.report["warnings"][0], "200 " in result.report["warnings"][1]] == [True, True]

    def test_no_surface_where_none_is_asked(self):
        result = reconstruct(shapes.sphere(200), FIELD_ONLY)
        assert result.surface is None
        assert result.sheet is None
        assert result.report["meshes"] == {}

    def test_resolution_sets_the_cells_along_the_longest_side(self):
        result = reconstruct(shapes.sphere(200) * [1, 0.5, 0.25], Settings(resolution=31, surface="none"))
        assert result.field.values.shape[0] == 32
        assert result.field.values.shape[2] < result.field.values.shape[1] < 32

    def test_pca_is_an_independent_answer_to_the_same_question(self, torus_run):
        pca = reconstruct(torus_run.points, Settings(resolution=24, surface="none", solver="pca"))
        agreement = cosines(pca.normals, torus_run.normals)
        assert np.median(agreement) > 0.999
        assert not np.array_equal(pca.normals, torus_run.normals)


class TestInvariance:
    """What must not depend on where the scan stands, how large it is or how its points are listed."""

    def test_twice_gives_the_same_bytes(self, points, here):
        again = reconstruct(points.copy(), SMALL)
        assert [a.tobytes() for a in arrays(again)] == [a.tobytes() for a in arrays(here)]

    def test_georeferenced_clouds_lose_nothing(self, points, here):
        shift = np.array([1e6, -1e6, 5e6])
        there = reconstruct(points + shift, SMALL)
        assert there.normals.tobytes() == here.normals.tobytes()
        assert there.confidence.tobytes() == here.confidence.tobytes()
        assert there.field.values.tobytes() == here.field.values.tobytes()
        assert there.field.spacing == here.field.spacing
        assert there.surface.faces.tobytes() == here.surface.faces.tobytes()
        np.testing.assert_allclose(there.field.origin - shift, here.field.origin, atol=2e-9)
        np.testing.assert_allclose(there.surface.vertices - shift, here.surface.vertices, atol=2e-9)

    @pytest.mark.parametrize("factor", [2.0**-40, 2.0**40])
    def test_a_power_of_two_scales_every_result_exactly(self, points, here, factor):
        there = reconstruct(points * factor, SMALL)
        assert there.normals.tobytes() == here.normals.tobytes()
        np.testing.assert_array_equal(there.field.values, here.field.values * np.float32(factor))
        np.testing.assert_array_equal(there.surface.vertices, here.surface.vertices * factor)
        assert there.field.spacing == here.field.spacing * factor

    @pytest.mark.parametrize("factor", [1e-9, 0.3048, 1e12])
    def test_any_factor_scales_every_result(self, points, here, factor):
        there = reconstruct(points * factor, SMALL)
        assert cosines(there.normals, here.normals).min() > 1 - 1e-6
        np.testing.assert_allclose(there.field.values / factor, here.field.values, atol=1e-3 * here.field.spacing)

    def test_rigid_motion_carries_over(self, points, here):
        rotation, shift = shapes.random_rotation(3), np.array([3.0, -20.0, 7.0])
        there = reconstruct(points @ rotation.T + shift, SMALL)
        assert cosines(there.normals, here.normals @ rotation.T).min() > 0.9999
        x = np.random.default_rng(1).uniform(-1.4, 1.4, (2000, 3))
        off = there.field.sample(x @ rotation.T + shift) - here.field.sample(x)
        assert np.abs(off).mean() < 0.1 * here.field.spacing

    def test_the_order_of_the_points_does_not_matter(self, points, here):
        order = np.random.default_rng(0).permutation(len(points))
        there = reconstruct(points[order], SMALL)
        np.testing.assert_array_equal(there.points, points[order])
        np.testing.assert_array_equal(there.normals, here.normals[order])
        np.testing.assert_array_equal(there.confidence, here.confidence[order])
        np.testing.assert_array_equal(there.field.values, here.field.values)
        np.testing.assert_array_equal(order[there.field.near.sample], here.field.near.sample)
        np.testing.assert_array_equal(there.surface.vertices, here.surface.vertices)
        np.testing.assert_array_equal(there.surface.faces, here.surface.faces)

    def test_nodes_near_the_surface_know_their_nearest_sample(self, here):
        near = here.field.near
        node = np.stack(np.unravel_index(near.node, near.shape), axis=1)
        x = here.field.origin + here.field.spacing * node
        of_its_own = np.linalg.norm(x - here.points[near.sample], axis=1)
        np.testing.assert_allclose(of_its_own, KDTree(here.points).query(x)[0], rtol=1e-6)

    def test_compares_by_identity(self, here, points):
        there = reconstruct(points, Settings(resolution=24, surface="none"))
        for mine, other in ((here, there), (here.field, there.field), (here.surface, there.surface)):
            assert mine == mine
            assert mine != other

    def test_the_seed_moves_results_by_less_than_one_sees(self, points, here):
        there = reconstruct(points, Settings(resolution=24, seed=1))
        assert cosines(there.normals, here.normals).min() > 0.9999
        np.testing.assert_allclose(there.field.values, here.field.values, atol=0.02 * here.field.spacing)


SHAPES = {
    "sphere": shapes.sphere(300),
    "random sphere": shapes.scattered_sphere(600),
    "hemisphere": shapes.hemisphere(400),
    "disc": shapes.disc(300),
    "cylinder": shapes.cylinder(500),
    "moebius": shapes.moebius(600),
    "junction": shapes.junction(800),
    "sheets": shapes.sheets(800, 0.1),
    "noise": np.random.default_rng(0).uniform(size=(200, 3)),
    "cubic grid": np.indices((5, 5, 5)).reshape(3, -1).T,
    "square grid": np.indices((12, 12, 1)).reshape(3, -1).T,
    "tetrahedron": np.concatenate([np.zeros((1, 3)), EYE]),
    "four in a plane": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]),
    "five": np.concatenate([np.zeros((1, 3)), EYE, [[1, 1, 1]]]),
    "one far away": np.concatenate([shapes.sphere(200), [[40, 0, 0]]]),
}


@pytest.mark.parametrize("points", SHAPES.values(), ids=SHAPES.keys())
def test_whatever_the_points_results_are_sound(points):
    """u is a distance: finite, not negative, at most the distance to the nearest sample; the surface is closed."""
    result = reconstruct(points, SMALL)
    values = result.field.values
    assert np.isfinite(values).all()
    assert values.min() >= 0
    nearest = KDTree(result.points).query(shapes.node_positions(result.field))[0]
    assert (values.ravel() - nearest).max() < 0.75 * result.field.spacing
    np.testing.assert_allclose(np.linalg.norm(result.normals, axis=1), 1, atol=1e-9)
    assert np.isfinite(result.confidence).all()
    assert set(result.surface.edge_counts()[1]) == {2}
    assert np.isfinite(result.surface.vertices).all()


def test_coplanar_points_give_a_flat_sheet(disc_run):
    np.testing.assert_allclose(np.abs(disc_run.normals[:, 2]), 1, atol=1e-9)
    assert np.abs(disc_run.surface.vertices[:, 2]).max() < 2e-3 * disc_run.field.spacing
    inside = np.hypot(*disc_run.surface.vertices[:, :2].T) < 1 + disc_run.field.spacing
    assert inside.all()


@pytest.mark.parametrize("solver", ["reflection", "pca"])
def test_constraints_hold_to_the_bit(solver):
    points = np.concatenate([shapes.sphere(300), [[np.nan] * 3], shapes.sphere(300)[:50] * 0.5])
    rows, axes = np.array([340, 5, 299]), np.array([[0.6, 0.0, 0.8], [-1.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    result = reconstruct(points, Settings(resolution=16, surface="none", solver=solver), constraints=(rows, axes))
    used = [int(np.flatnonzero(result.source_index == row)[0]) for row in rows]
    np.testing.assert_array_equal(result.normals[used], [[0.6, 0.0, 0.8], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def test_a_constraint_reaches_its_neighbours():
    """Axes turned away from the plane at some samples turn those between them."""
    points = shapes.disc(300)
    held = np.flatnonzero(np.arange(300) % 3 > 0)
    free = np.setdiff1d(np.arange(300), held)
    tilted = np.tile([0.6, 0.0, 0.8], (len(held), 1))
    result = reconstruct(points, FIELD_ONLY, constraints=(held, tilted))
    assert np.abs(result.normals[free] @ [1, 0, 0]).mean() > 0.05


def test_no_constraints_and_constraints_on_dropped_rows_change_nothing():
    points = np.concatenate([shapes.sphere(200), shapes.sphere(200)[:1]])
    plain = reconstruct(points, FIELD_ONLY)
    for constraints in (([], np.empty((0, 3))), ([], []), ([200], EYE[:1])):
        assert reconstruct(points, FIELD_ONLY, constraints).normals.tobytes() == plain.normals.tobytes()


def test_masked_indices_of_constraints_are_left_out():
    points = shapes.sphere(200)
    masked = np.ma.array([3, 5], mask=[True, False])
    (with_both, with_one) = (reconstruct(points, FIELD_ONLY, given) for given in ((masked, EYE[:2]), ([5], EYE[1:2])))
    assert with_both.normals.tobytes() == with_one.normals.tobytes()


class NeedsGradients:
    """What refuses to become an array as a tensor does that gradients are asked of."""

    def __array__(self, *_, **__):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.")


def test_what_refuses_to_be_an_array_is_named():
    with pytest.raises(InputError, match=r"points are not an array of real numbers .*requires grad"):
        reconstruct(NeedsGradients())


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        ("ab", "constraint axes are not an array of real numbers"),
        (([0], [[1j, 0, 0]]), "constraint axes are not .*complex numbers"),
        (([[0], [1, 2]], EYE[:2]), "constraints are not"),
        (([0],), "constraints are not"),
        (([0, 1], EYE[:1]), r"\(2,\).*\(1, 3\)"),
        (([0], [[1, 0]]), r"\(1,\).*\(1, 2\)"),
        (([0.5], EYE[:1]), "give whole numbers"),
        (([[0]], EYE[:1]), r"\(1, 1\)"),
        (([0, 1], [[0, 0, 0], [1, 0, 0]]), "1 constraint axes have no direction"),
        (([0], [[np.nan, 0, 0]]), "1 constraint axes have no direction"),
    ],
)
def test_bad_constraints_are_named(constraints, message):
    with pytest.raises(InputError, match=message):
        reconstruct(shapes.sphere(50), FIELD_ONLY, constraints)


def test_bad_points_are_named_before_any_work():
    calls = []
    with pytest.raises(InputError, match=r"shape \(5, 2\)"):
        reconstruct(np.zeros((5, 2)), FIELD_ONLY, progress=lambda *call: calls.append(call))
    assert calls == []


class TestProgress:
    def test_never_goes_back_and_ends_at_one(self, calls):
        fractions = [fraction for fraction, _ in calls]
        assert fractions == sorted(fractions)
        assert fractions[0] >= 0
        assert fractions[-1] == 1
        assert [fraction for fraction, _ in distinct(calls)].count(1) == 1

    def test_names_every_stage_in_order(self, calls):
        stages = list(dict.fromkeys(text for _, text in calls if text))
        assert stages == ["cleaning", "normals", "distance field", "crossings", "single layer", "report"]

    def test_false_stops_the_run_at_that_very_call(self, calls):
        calls = distinct(calls)
        for last in range(len(calls)):
            seen = []

            def cancel(*call, seen=seen, last=last):
                seen.append(call)
                return len(distinct(seen)) <= last

            with pytest.raises(Cancelled, match="nothing was written"):
                reconstruct(shapes.sphere(300), SMALL, progress=cancel)
            assert distinct(seen) == calls[: last + 1]


class TestMask:
    """A real open surface with holes and two loose pieces, against its true mesh by libigl."""

    def test_field_is_the_distance_to_the_true_mesh(self, mask, mask_run):
        x = shapes.node_positions(mask_run.field)[::17]
        true = np.sqrt(igl.point_mesh_squared_distance(x, *mask[1:])[0])
        off = np.abs(mask_run.field.values.ravel()[::17] - true) / mask_run.field.spacing
        assert off.mean() < 0.15
        assert np.percentile(off, 95) < 0.6

    def test_surface_lies_on_the_true_mesh(self, mask, mask_run):
        off = np.sqrt(igl.point_mesh_squared_distance(mask_run.surface.vertices, *mask[1:])[0]) / mask_run.field.spacing
        assert np.median(off) < 0.05
        assert np.percentile(off, 95) < 0.6

    def test_surface_covers_the_true_mesh(self, mask, mask_run):
        surface = mask_run.surface
        off = np.sqrt(igl.point_mesh_squared_distance(mask[1], surface.vertices, surface.faces.astype(np.int64))[0])
        assert np.percentile(off, 99) < mask_run.field.spacing

    def test_axes_are_those_of_the_true_mesh(self, mask, mask_run):
        _, face, _ = igl.point_mesh_squared_distance(mask_run.points, *mask[1:])
        a, b, c = (mask[1][mask[2][face, k]] for k in range(3))
        true = np.cross(b - a, c - a)
        true /= np.linalg.norm(true, axis=1, keepdims=True)
        assert cosines(mask_run.normals, true).mean() > 0.98


def test_bust_is_hollow_and_closed_in_double():
    result = reconstruct(vertices(PlyData.read(DATA / "bust.ply")), Settings(resolution=64))
    assert set(result.surface.edge_counts()[1]) == {2}
    largest = shapes.components(result.surface)[0]
    assert len(largest.faces) > 0.95 * len(result.surface.faces)
    assert KDTree(result.surface.vertices).query(result.points)[0].max() < 2 * result.field.spacing
    assert (result.field.sample(result.points) < 0.75 * result.field.spacing).all()


def test_coordinates_rounded_far_away_are_said():
    ball = 10 * shapes.scattered_sphere(2000)
    for far, told in (([4e5, 5e6, 0], True), ([400, 5000, 0], False)):
        points = (ball + np.array(far)).astype(np.float32)
        warnings = reconstruct(points, Settings(resolution=32, surface="none")).report["warnings"]
        assert any("in steps of 0.5, 6" in line and "% of the points' spacing" in line for line in warnings) == told


def test_a_grid_too_coarse_for_the_points_is_said():
    ball = shapes.sphere(2000)
    far = reconstruct(np.concatenate([ball, ball + np.array([200, 0, 0])]), Settings(resolution=32, surface="none"))
    assert [line for line in far.report["warnings"] if "cells apart" in line]
    near = reconstruct(ball, Settings(resolution=32, surface="none"))
    assert near.report["warnings"] == []
