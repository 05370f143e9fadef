"""Whatever is fed in: sound results or one line that says what is wrong; never a crash, a hang or a NaN."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core import Settings, SettingsError, VADError, reconstruct
from core.points import prepare_samples
from tests import shapes

RESOLUTION = 16
LONGEST = 20.0  # seconds for any run here; the ordinary one takes a fifth of a second


def uv_sphere(rings, segments):
    """Every ring cospherical and coplanar, the poles many times."""
    up, around = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, segments))
    return np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], -1).reshape(-1, 3)


def box_grid(n):
    x = np.stack(np.meshgrid(*3 * [np.arange(n)], indexing="ij"), -1).reshape(-1, 3)
    return x[(x % (n - 1) == 0).any(axis=1)].astype(float)


def solid_grid(n):
    return np.stack(np.meshgrid(*3 * [np.arange(n)], indexing="ij"), -1).reshape(-1, 3).astype(float)


def wireframe(n):
    """Points along the edges of a cube."""
    t = np.linspace(-1, 1, n)
    edges = [np.roll([(s, a, b) for s in t], axis, axis=1) for axis in range(3) for a in (-1, 1) for b in (-1, 1)]
    return np.unique(np.concatenate(edges), axis=0)


CLOUDS = {
    "sphere": shapes.sphere(300),
    "scattered": shapes.scattered_sphere(300),
    "disc": shapes.disc(200),
    "lattice": box_grid(15)[:225],
    "moebius": shapes.moebius(300),
    "junction": shapes.junction(300),
    "sheets": shapes.sheets(300, gap=0.05),
    "uv sphere": uv_sphere(12, 24),
    "box grid": box_grid(6),
    "solid grid": solid_grid(6),
    "wireframe": wireframe(20),
    "noise": np.random.default_rng(0).normal(size=(200, 3)),
    "tetrahedron": np.vstack([np.eye(3), np.zeros((1, 3))]),
    "square": np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]),
}
DIRT = {
    "none": lambda x, rng: x,
    "half twice": lambda x, rng: np.vstack([x, x[: len(x) // 2]]),
    "nearly twice": lambda x, rng: np.vstack([x, x * (1 + 1e-15)]),
    "NaN rows": lambda x, rng: np.vstack([x, np.full((3, 3), np.nan)]),
    "infinite rows": lambda x, rng: np.vstack([[[np.inf, 0, 0], [0, -np.inf, 0]], x]),
    "far outlier": lambda x, rng: np.vstack([x, [[1e6, 0, 0]]]),
    "far copy": lambda x, rng: np.vstack([x, x + 1e3]),
    "small far copy": lambda x, rng: np.vstack([x, 1e-3 * x + 50]),
    "uniform outliers": lambda x, rng: np.vstack([x, rng.uniform(-2, 2, (len(x) // 10 + 1, 3))]),
    "noise": lambda x, rng: x + rng.normal(size=x.shape) * 0.02,
    "rounded": lambda x, rng: np.round(x, 1),
    "shuffled": lambda x, rng: rng.permutation(x),
}
FORMS = {
    "float64": lambda x: x,
    "float32": lambda x: x.astype(np.float32),
    "float16": lambda x: np.clip(x, -6e4, 6e4).astype(np.float16),
    "integer": lambda x: np.rint(np.nan_to_num(x * 50, posinf=0, neginf=0)).astype(np.int32),
    "every other column": lambda x: np.repeat(x, 2, axis=1)[:, ::2],
    "column order": lambda x: np.asfortranarray(x),
    "backwards": lambda x: x[::-1],
    "big endian": lambda x: x.astype(">f8"),
    "read-only": lambda x: _frozen(x),
    "list": lambda x: x.tolist(),
}


def _frozen(x):
    x = x.copy()
    x.flags.writeable = False
    return x


def assert_sound(result, points):
    """No NaN, rows traced, axes unit, distances nowhere negative, all in the place of the input."""
    points = np.asarray(points, np.float64)
    low, high = np.nanmin(result.points, axis=0), np.nanmax(result.points, axis=0)
    size = (high - low).max()
    moved = np.linalg.norm(result.points - points[result.source_index], axis=1)
    noise = result.report["cleaning"].get("noise", 0.0)
    assert moved.max() <= 8.001 * noise  # four standard deviations of at most twice the median noise
    assert len(np.unique(result.source_index)) == len(result.points)
    assert np.linalg.norm(result.normals, axis=1) == pytest.approx(1.0)
    assert ((result.confidence >= 0) & (result.confidence <= 1)).all()
    assert np.isfinite(result.field.values).all()
    assert (result.field.values >= 0).all()
    assert np.isfinite(result.surface.vertices).all()
    assert np.abs(result.surface.vertices - (low + high) / 2).max(initial=0) <= size
    if len(result.surface.faces):
        assert result.surface.faces.max() < len(result.surface.vertices)


@settings(max_examples=120)
@given(
    cloud=st.sampled_from(sorted(CLOUDS)),
    dirt=st.sampled_from(sorted(DIRT)),
    form=st.sampled_from(sorted(FORMS)),
    exponent=st.integers(-9, 9),
    shift=st.sampled_from([0.0, 1.0, -1e3, 1e6]),
    denoise=st.sampled_from(["auto", 0, 1]),
)
def test_a_run_is_sound_or_says_why_not(cloud, dirt, form, exponent, shift, denoise):
    points = DIRT[dirt](CLOUDS[cloud], np.random.default_rng(1))
    points = FORMS[form]((points + shift) * (1.0 if form in ("integer", "float16") else 10.0**exponent))
    start = time.perf_counter()
    refusal = ""
    try:
        result = reconstruct(points, Settings(resolution=RESOLUTION, denoise=denoise))
    except VADError as error:
        refusal = str(error)
    if refusal:
        assert "\n" not in refusal
    else:
        assert_sound(result, points)
    assert time.perf_counter() - start < LONGEST


@settings(max_examples=200)
@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers()
        | st.floats()
        | st.text()
        | st.binary(max_size=3)
        | st.complex_numbers(),
        lambda inner: st.lists(inner, max_size=4),
        max_leaves=12,
    )
)
def test_what_is_no_cloud_is_refused_in_a_line(anything):
    with pytest.raises(VADError) as caught:
        prepare_samples(anything)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_million_equal_points_are_refused_at_once():
    start = time.perf_counter()
    with pytest.raises(VADError, match="1 distinct finite points of 1000000 given"):
        reconstruct(np.ones((1_000_000, 3)))
    assert time.perf_counter() - start < 5


def test_a_million_copies_of_a_few_points_are_those_points():
    points = np.tile(CLOUDS["tetrahedron"], (250_000, 1))
    assert len(reconstruct(points, Settings(resolution=RESOLUTION)).points) == 4


def test_a_far_outlier_does_not_coarsen_the_grid():
    points = np.vstack([shapes.sphere(1000), [[1e6, 0, 0]]])
    result = reconstruct(points, Settings(resolution=32, surface="none"))
    assert result.field.spacing < 0.1
    assert result.report["cleaning"]["outliers"] == 1
    assert 1000 not in result.source_index


def test_settings_that_are_none_are_refused():
    for none in ({"resolution": 16}, None):
        with pytest.raises(SettingsError, match=r"give Settings\(...\)"):
            reconstruct(shapes.sphere(100), none)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("distance", [3e5, 1e6, 1e9])
def test_objects_as_far_apart_as_numbers_reach(distance):
    torus = shapes.torus(1500)
    away = np.array([distance, 0, 0])
    tori = np.vstack([torus, torus + away])
    assert_sound(reconstruct(tori, Settings(resolution=RESOLUTION, outliers=False)), tori)


def test_beside_a_far_outlier_the_order_of_the_points_changes_no_byte():
    points = np.vstack([shapes.scattered_sphere(400), [[1e8, 0, 0]]])
    order = np.random.default_rng(1).permutation(len(points))
    one, other = (reconstruct(x, Settings(resolution=RESOLUTION)) for x in (points, points[order]))
    np.testing.assert_array_equal(one.field.values, other.field.values)
    np.testing.assert_array_equal(one.surface.vertices, other.surface.vertices)


def test_a_few_points_in_one_cell_beside_one_far_away():
    """Thousands of spacings off the cluster, where its kernels are all zero."""
    points = 0.01 * np.random.default_rng(4).normal(size=(8, 3))
    points[2] = [1000, 0, 0]
    assert_sound(reconstruct(points, Settings(resolution=RESOLUTION)), points)


def test_two_far_apart_objects_are_both_kept():
    points = np.vstack([shapes.sphere(500), shapes.sphere(500) + 30])
    result = reconstruct(points, Settings(resolution=64))
    assert len(result.points) == 1000
    assert len(shapes.components(result.surface)) >= 2


@pytest.mark.parametrize("cloud", [uv_sphere(60, 120), box_grid(25), solid_grid(14), shapes.square(3600)])
def test_cospherical_and_coplanar_points_take_no_longer(cloud):
    start = time.perf_counter()
    reconstruct(cloud, Settings(resolution=RESOLUTION, surface="none"))
    assert time.perf_counter() - start < LONGEST
