import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from core import InputError, denoise, fit_grid, remove_outliers
from core.points import local_spacing, prepare_samples, rounding_warning
from tests import shapes

TETRAHEDRON = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


@pytest.mark.parametrize("kind", [list, tuple, np.float32, np.int16, ">f8"])
def test_takes_what_numpy_takes(kind):
    points = kind(TETRAHEDRON) if kind in (list, tuple) else np.array(TETRAHEDRON, kind)
    samples = prepare_samples(points)
    assert samples.given.dtype == samples.points.dtype == np.float64
    assert samples.given.tolist() == TETRAHEDRON


def test_unit_frame_is_centred_with_longest_side_one(random):
    points = random.normal(size=(100, 3)) * [1, 5, 2] + [7, -3, 1000]
    samples = prepare_samples(points)
    low, high = samples.points.min(axis=0), samples.points.max(axis=0)
    np.testing.assert_allclose(low + high, 0, atol=1e-12)
    assert (high - low).max() == pytest.approx(1, abs=1e-12)
    assert samples.scale == pytest.approx(np.ptp(points[:, 1]))
    np.testing.assert_allclose(samples.to_input_units(samples.points), points, atol=1e-9)
    assert samples.warnings == ()


def test_the_input_is_left_alone():
    points = shapes.sphere(50)
    kept = points.copy()
    samples = prepare_samples(points)
    samples.given[:] = 0
    np.testing.assert_array_equal(points, kept)


def test_drops_rows_that_are_not_finite_with_a_count():
    points = np.insert(
        np.array(TETRAHEDRON, float), [0, 2, 4], [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]], axis=0
    )
    samples = prepare_samples(points)
    np.testing.assert_array_equal(samples.given, TETRAHEDRON)
    np.testing.assert_array_equal(samples.source_index, [1, 2, 4, 5])
    assert len(samples.warnings) == 1
    assert "3 of 7" in samples.warnings[0]
    assert "NaN" in samples.warnings[0]


def test_drops_rows_with_a_masked_number():
    points = np.ma.masked_equal([*TETRAHEDRON, [0, 7, 2]], 7)
    samples = prepare_samples(points)
    np.testing.assert_array_equal(samples.given, TETRAHEDRON)
    assert "1 of 5" in samples.warnings[0]


def test_keeps_the_first_of_equal_points_in_the_order_given():
    points = np.array([*TETRAHEDRON[::-1], *TETRAHEDRON, [-0.0, 0.0, -0.0]], float)
    samples = prepare_samples(points)
    np.testing.assert_array_equal(samples.source_index, [0, 1, 2, 3])
    np.testing.assert_array_equal(samples.given, TETRAHEDRON[::-1])
    assert len(samples.warnings) == 1
    assert samples.warnings[0].startswith("5 ")


def test_points_one_ulp_apart_are_distinct():
    points = np.array([*TETRAHEDRON, [np.nextafter(1, 2), 0, 0]])
    assert len(prepare_samples(points).points) == 5


rows = arrays(np.float64, st.tuples(st.integers(0, 12), st.just(3)), elements=st.sampled_from([0.0, 1.0, 2.0, np.nan]))


@given(rows)
def test_samples_are_the_distinct_finite_rows(extra):
    points = np.concatenate([extra, TETRAHEDRON])
    samples = prepare_samples(points)
    np.testing.assert_array_equal(samples.given, points[samples.source_index])
    assert (np.diff(samples.source_index) > 0).all()
    finite = points[np.isfinite(points).all(axis=1)]
    np.testing.assert_array_equal(np.unique(samples.given, axis=0), np.unique(finite, axis=0))
    assert len(np.unique(samples.given, axis=0)) == len(samples.given)


def test_an_exact_shift_changes_no_bit(random):
    points = random.integers(-(2**20), 2**20, (200, 3)) / 2**16
    here, there = prepare_samples(points), prepare_samples(points + 1e6)
    assert here.points.tobytes() == there.points.tobytes()
    assert here.scale == there.scale
    np.testing.assert_array_equal(there.centre, here.centre + 1e6)
    points = 1e6 + random.random((200, 3))
    assert prepare_samples(points).points.tobytes() == prepare_samples(points - 1e6).points.tobytes()


@pytest.mark.parametrize("factor", [2.0**-60, 2.0**60])
def test_a_power_of_two_changes_no_bit(factor, random):
    points = random.normal(size=(200, 3))
    here, there = prepare_samples(points), prepare_samples(points * factor)
    assert here.points.tobytes() == there.points.tobytes()
    assert there.scale == here.scale * factor


def test_a_plane_is_fine():
    assert len(prepare_samples(shapes.disc(20)).points) == 20


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([], r"\(0,\).*\(n,3\)"),
        (np.zeros((5, 2)), r"\(5, 2\).*\(n,3\)"),
        (np.zeros((3, 3, 3)), r"\(3, 3, 3\).*\(n,3\)"),
        (np.zeros((0, 3)), "0 distinct finite points of 0.*at least 4"),
        (np.ones((9, 3)), "1 distinct finite points of 9.*at least 4"),
        (np.full((9, 3), np.nan), "0 distinct finite points of 9.*at least 4"),
        ([["a", "b", "c"]] * 4, "real numbers"),
        ([[0, 0, 0], [1, 0], [0, 1, 0], [0, 0, 1]], "real numbers"),
        (np.array(TETRAHEDRON) * 1j, "complex"),
        ([[10**400, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "real numbers"),
        (np.arange(30.0)[:, None] * [1, 2, 3], "30 distinct points lie on one line"),
        ([[-1e308, 0, 0], [1e308, 0, 0], [0, 1, 0], [0, 0, 1]], "inf.*scale them"),
        (np.array(TETRAHEDRON) * 1e-310, "1e-310.*scale them"),
    ],
)
def test_names_what_is_wrong_in_one_line(points, message):
    with pytest.raises(InputError, match=message) as caught:
        prepare_samples(points)
    assert "\n" not in str(caught.value)


def test_spacing_is_the_mean_distance_to_the_six_nearest(random):
    points = random.normal(size=(60, 3))
    distances = np.sort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)
    np.testing.assert_allclose(local_spacing(points), distances[:, 1:7].mean(axis=1))


def test_spacing_of_few_points_uses_them_all():
    np.testing.assert_allclose(local_spacing(np.array(TETRAHEDRON, float))[0], 1)


def test_spacing_of_a_cubic_grid_is_its_step_inside():
    grid = np.indices((5, 5, 5)).reshape(3, -1).T * 0.25
    inside = ((grid > 0) & (grid < 1)).all(axis=1)
    np.testing.assert_allclose(local_spacing(grid)[inside], 0.25)


def test_single_stages_take_lists_and_integers_and_refuse_what_is_no_cloud():
    lattice = [[i, j, k] for i in range(6) for j in range(6) for k in range(6)]
    spacing = local_spacing(lattice)
    np.testing.assert_array_equal(spacing, local_spacing(np.array(lattice, float)))
    assert denoise(np.array(lattice), spacing, 1.0)[0].shape == (216, 3)
    assert len(remove_outliers(lattice)[0]) == 216
    assert fit_grid(lattice, 16).shape == (17, 17, 17)
    broken = np.array(lattice, float)
    broken[3] = np.nan
    for stage in (local_spacing, remove_outliers, lambda x: denoise(x, spacing), lambda x: fit_grid(x, 16)):
        with pytest.raises(InputError, match="finite"):
            stage(broken)
    with pytest.raises(InputError, match="1 points given; at least 2 are needed"):
        local_spacing([[0, 0, 0]])
    with pytest.raises(InputError, match="not all in one place"):
        fit_grid(np.ones((5, 3)), 16)


@pytest.mark.parametrize(("shift", "told"), [(0, False), (3e4, False), (4e5, True), (2.0**19, True), (3e7, True)])
def test_coordinates_that_single_precision_rounded_are_told(shift, told):
    """Beyond a power of two, 2^19 here, steps are twice as long; one point close to the origin has others, too."""
    points = np.vstack([10 * shapes.scattered_sphere(2000) + [shift, 0, 0], [0.1234567, 0, 0]])
    spacing = float(np.median(local_spacing(points)))
    warning = rounding_warning(points.astype(np.float32).astype(float), spacing)
    assert bool(warning) == told
    assert not told or "in steps of 0.0" in warning[0] or "in steps of 2" in warning[0]
    assert not rounding_warning(points, spacing)


@pytest.mark.parametrize(("far", "told"), [(0, False), (1e6, False), (1e7, True), (1e9, False), (1e300, False)])
def test_whole_numbers_look_rounded_only_where_these_are_the_steps(far, told):
    points = np.stack(np.meshgrid(*[np.arange(8.0)] * 3), axis=-1).reshape(-1, 3) + far
    assert bool(rounding_warning(points, 1.0)) == told


def test_outliers_are_not_looked_for_where_powers_of_distances_overflow():
    with pytest.raises(InputError, match=r"the points span 1.99.* need a span from 1e-60 to 1e\+60"):
        remove_outliers(1e200 * shapes.sphere(150))
