import numpy as np
import pytest

from core import Cancelled
from core.normals.creases import normals_of_sheets
from core.normals.mirrors import Mirrors
from core.normals.reflection import reflection_sweeps
from core.points import local_spacing
from core.voronoi.facets import voronoi_facets
from tests import shapes


def swept(points):
    """Local spacing, Mirrors, and axes as the sweeps leave them."""
    spacing = local_spacing(points)
    mirrors = Mirrors(points, spacing, voronoi_facets(points, spacing))
    return spacing, mirrors, reflection_sweeps(mirrors)[0]


def parted(points, fixed=()):
    spacing, mirrors, axes = swept(points)
    return axes, *normals_of_sheets(points, spacing, mirrors, axes, fixed)


def scattered_cube(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Random points on the faces of [-1, 1]^3, and the normals there."""
    rng = np.random.default_rng(3)
    normals = np.concatenate([np.eye(3), -np.eye(3)])[rng.integers(0, 6, n)]
    return np.where(normals == 0, rng.uniform(-1, 1, (n, 3)), normals), normals


def roof(angle: float, n: int = 2000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random points on two squares that meet along the x axis at an angle, radians: points, normals, and distance to
    that axis."""
    rng = np.random.default_rng(5)
    x, away = rng.uniform(-1, 1, n), rng.uniform(0, 1, n)
    turn = np.where(rng.random(n) < 0.5, 0.0, angle)
    points = np.column_stack([x, away * np.cos(turn), away * np.sin(turn)])
    return points, np.column_stack([0 * x, -np.sin(turn), np.cos(turn)]), away


def degrees(a, b):
    return np.degrees(np.arccos(np.minimum(np.abs(np.einsum("ni,ni->n", a, b)), 1.0)))


def off_all_faces(axes):
    """How far axes are from the normals of all faces of a cube, degrees."""
    return np.degrees(np.arccos(np.minimum(np.abs(axes).max(axis=1), 1.0)))


def test_samples_of_a_cube_have_the_normals_of_its_faces():
    points, truth = scattered_cube(3000)
    before, axes, confidence, beside = parted(points)
    assert (off_all_faces(before) > 5).mean() > 0.1
    assert (off_all_faces(axes) > 5).mean() < 0.002
    assert off_all_faces(axes).mean() < 0.06
    assert (degrees(axes, truth) > 10).sum() < 0.4 * (degrees(before, truth) > 10).sum()
    assert 0.03 < beside.mean() < 0.25
    assert np.median(confidence[beside]) > 0.98


@pytest.mark.parametrize("angle", [60, 90, 120])
def test_both_sides_of_a_crease_at_any_angle(angle):
    points, truth, away = roof(np.radians(angle))
    before, axes, _, beside = parted(points)
    near = away < 0.5 * np.median(local_spacing(points))
    assert np.median(degrees(before, truth)[near]) > 15
    assert np.median(degrees(axes, truth)[near]) < 4
    assert away[beside].max() < 4 * np.median(local_spacing(points))


def test_sheets_that_cross_or_end_on_each_other():
    points = shapes.junction(2000)
    truth = np.where((points[:, 2] == 0)[:, None], [0.0, 0, 1], [1.0, 0, 0])
    before, axes, _, _ = parted(points)
    assert (degrees(axes, truth) > 10).sum() < 0.5 * (degrees(before, truth) > 10).sum()


@pytest.mark.parametrize(
    "points",
    [shapes.square(600), shapes.scattered_sphere(800), shapes.torus(1500), shapes.moebius(900), shapes.cylinder(1200)],
    ids=["plane", "sphere", "torus", "moebius", "cylinder"],
)
def test_nothing_changes_where_there_is_no_crease(points):
    spacing, mirrors, before = swept(points)
    axes, confidence, beside = normals_of_sheets(points, spacing, mirrors, before)
    assert not beside.any()
    np.testing.assert_array_equal(axes, before)
    np.testing.assert_array_equal(confidence, mirrors.confidence(before))


def test_axes_given_stay_bit_identical():
    points, _ = scattered_cube(1500)
    beside = np.flatnonzero(parted(points)[3])
    before, axes, _, moved = parted(points, fixed=beside[::2])
    assert axes[beside[::2]].tobytes() == before[beside[::2]].tobytes()
    assert not moved[beside[::2]].any()
    assert moved[beside[1::2]].any()


def test_follows_motion_and_scale():
    points, _, _ = roof(np.pi / 2, 1200)
    turn = shapes.random_rotation(4)
    _, axes, _, _ = parted(points)
    _, turned, _, _ = parted(30 * points @ turn.T + [5, -2, 1])
    assert np.quantile(degrees(turned @ turn, axes), 0.99) < 0.5


@pytest.mark.parametrize("count", [4, 5, 12])
def test_few_samples(count):
    points = scattered_cube(count)[0]
    _, axes, confidence, _ = parted(points)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    assert ((confidence >= 0) & (confidence <= 1)).all()


def test_cancels():
    points, _ = scattered_cube(600)
    spacing, mirrors, axes = swept(points)
    with pytest.raises(Cancelled):
        normals_of_sheets(points, spacing, mirrors, axes, progress=lambda *_: False)


def test_neighbours_left_out_leave_weights_that_sum_to_one_and_never_too_few():
    _, mirrors, axes = swept(shapes.torus(500))
    count, some = len(axes), np.random.default_rng(0).random(len(mirrors.site)) < 0.4
    some[mirrors.site < 20] = True
    left = mirrors.without(some)
    np.testing.assert_allclose(left.gather.sum(axis=1), 1.0)
    assert (left.weight[some & (mirrors.site >= 200)] == 0).mean() > 0.9
    np.testing.assert_array_equal(left.weight[mirrors.site < 20], mirrors.weight[mirrors.site < 20])
    here = mirrors.at(np.arange(count) < 50)
    np.testing.assert_allclose(here.plane_fit()[:50], mirrors.plane_fit()[:50], atol=1e-9)
