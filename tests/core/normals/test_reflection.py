import numpy as np
import pytest

from core import Cancelled
from core.normals.adam import minimise
from core.normals.energy import NormalEnergy
from core.normals.mirrors import Mirrors
from core.normals.reflection import MAX_SWEEPS, reflection_sweeps
from core.points import local_spacing
from core.voronoi.bisectors import bisector_samples
from core.voronoi.facets import voronoi_facets
from core.voronoi.polygons import facet_polygons
from tests import shapes
from tests.shapes import scattered_sphere as random_axes


def sweeps(points, constraints=None, start=None):
    mirrors = mirrors_of(points)
    normals, count = reflection_sweeps(mirrors, constraints, start)
    return normals, mirrors.confidence(normals), count


def mirrors_of(points):
    spacing = local_spacing(points)
    return Mirrors(points, spacing, voronoi_facets(points, spacing))


def collinearity(a, b):
    return np.abs(np.einsum("ni,ni->n", a, b)).mean()


def degrees(a, b):
    return np.degrees(np.arccos(np.minimum(np.abs(np.einsum("ni,ni->n", a, b)), 1.0)))


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def torus_normals(points, major=1.0):
    ring = unit(points * [1, 1, 0]) * major
    return unit(points - ring)


def test_exact_on_a_plane():
    points = shapes.square(400) @ shapes.random_rotation(2).T
    normals, confidence, count = sweeps(points)
    np.testing.assert_allclose(np.abs(normals @ shapes.random_rotation(2)[:, 2]), 1.0, atol=1e-9)
    np.testing.assert_allclose(confidence, 1.0, atol=1e-9)
    assert count < 3


def test_exact_on_a_sphere_from_a_random_start():
    points = shapes.sphere(500)
    normals, confidence, _ = sweeps(points, start=random_axes(500, 5))
    assert degrees(normals, points).max() < 1
    assert confidence.min() > 0.999


@pytest.mark.parametrize(
    ("points", "truth"),
    [(shapes.torus(1500), torus_normals), (shapes.cylinder(1200), lambda x: unit(x * [1, 1, 0]))],
    ids=["torus", "cylinder"],
)
def test_curved_shapes_do_not_depend_on_the_start(points, truth):
    free = collinearity(sweeps(points)[0], truth(points))
    assert free > 0.998
    for seed in range(3):
        random = collinearity(sweeps(points, start=random_axes(len(points), seed))[0], truth(points))
        assert abs(random - free) < 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_samples_almost_on_top_of_each_other_do_not_hold_on_to_their_start(seed):
    points = shapes.scattered_sphere(1500)
    points[:300] = unit(points[300:600] + 1e-3 * np.random.default_rng(seed).normal(size=(300, 3)))
    assert degrees(sweeps(points, start=random_axes(1500, seed))[0], sweeps(points)[0]).max() < 5


def test_junction_keeps_each_sheet_flat():
    points = shapes.junction(1500)
    flat = points[:, 2] == 0
    truth = np.where(flat[:, None], [0.0, 0, 1], [1.0, 0, 0])
    away = np.hypot(points[:, 0], points[:, 2]) > 0.15
    normals, confidence, _ = sweeps(points)
    assert degrees(normals, truth)[away].max() < 3
    assert collinearity(normals, truth) > 0.99
    assert confidence[away].min() > confidence[~away].min() + 0.1


def test_follows_motion_scale_and_order_and_ignores_signs(random):
    points = shapes.moebius(900)
    normals = sweeps(points)[0]
    turn = shapes.random_rotation(4)
    assert degrees(sweeps(30 * points @ turn.T + [5, -2, 1])[0] @ turn, normals).max() < 0.05
    order = random.permutation(len(points))
    assert degrees(sweeps(points[order])[0], normals[order]).max() < 0.05
    start = random_axes(len(points), 1)
    flipped = start * random.choice([-1.0, 1.0], len(points))[:, None]
    np.testing.assert_allclose(degrees(sweeps(points, start=flipped)[0], sweeps(points, start=start)[0]), 0, atol=1e-4)


def test_same_input_same_bytes():
    points = shapes.torus(600)
    assert sweeps(points)[0].tobytes() == sweeps(points)[0].tobytes()


def test_constraints_stay_bit_identical_and_their_neighbours_mirror_them():
    """Samples of a plane say for themselves what it is: a row that is held tilted is answered, mirrored and weaker, by
    its neighbours alone."""
    points = np.column_stack([np.indices((21, 21)).reshape(2, -1).T - 10.0, np.zeros(441)])
    held = np.flatnonzero(points[:, 0] == 0)
    tilted = np.tile([np.sin(0.5), 0.0, np.cos(0.5)], (len(held), 1))
    normals = sweeps(points, (held, tilted))[0]
    assert normals[held].tobytes() == tilted.tobytes()
    lean = np.abs(points[:, 0]), normals[:, 0] * np.sign(normals[:, 2])
    assert lean[1][lean[0] == 1].max() < -0.05
    assert np.abs(lean[1][lean[0] > 6]).max() < 1e-3


def test_start_is_not_written_to():
    points, start = shapes.sphere(100), random_axes(100, 0)
    before = start.copy()
    sweeps(points, (np.array([0]), np.array([[1.0, 0, 0]])), start)
    np.testing.assert_array_equal(start, before)


def test_stops_after_the_sweeps_asked_for():
    mirrors, start = mirrors_of(shapes.junction(300)), random_axes(300, 0)
    three, count = reflection_sweeps(mirrors, start=start, most=3)
    assert count == 3
    once, _ = reflection_sweeps(mirrors, start=start, most=1)
    np.testing.assert_array_equal(reflection_sweeps(mirrors, start=once, most=2)[0], three)


def test_cancels():
    mirrors = mirrors_of(shapes.sphere(100))
    with pytest.raises(Cancelled):
        reflection_sweeps(mirrors, progress=lambda *_: False)


def flower(petals: int = 5, count: int = 12):
    """Bent petals that meet in the middle, sampled by their midribs alone, so that how far each one is twisted is
    open: points and upright axes, tangents across, (petals, count, 3), without the middle."""
    angle = 2 * np.pi * np.arange(petals)[:, None] / petals * np.ones(count)
    radius = np.arange(1, count + 1)[None, :, None] / count
    outward = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    axes = up - radius * outward
    sideways = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=-1)
    return radius * outward + radius**2 / 2 * up, axes / np.linalg.norm(axes, axis=-1, keepdims=True), sideways


def test_axes_given_at_the_ends_of_a_flowers_petals_twist_them_smoothly():
    petals, upright, sideways = flower()
    points, middle = np.concatenate([[[0, 0, 0]], petals.reshape(-1, 3)]), np.array([[0.0, 0, 1]])
    held = np.flatnonzero(np.concatenate([[0], np.tile(np.arange(1, 13) > 8, 5)]))
    for twist in np.radians([-50, 0, 30, 50]):
        axes = np.cos(twist) * upright + np.sin(twist) * sideways
        given = np.concatenate([middle, axes.reshape(-1, 3)])[held]
        normals = sweeps(points, (held, given))[0]
        assert normals[held].tobytes() == given.tobytes()
        normals = normals[1:].reshape(petals.shape)
        along, across = (np.einsum("pci,pci->pc", normals, axis) for axis in (upright, sideways))
        found = np.degrees(np.arctan(across / along))
        assert np.abs(np.diff(found, axis=1)).max() < 12
        assert np.abs(found[:, 0]).max() < 2
        np.testing.assert_allclose(found[:, 6], 0.5 * np.degrees(twist), atol=10)
        np.testing.assert_allclose(found, found[:1].repeat(5, axis=0), atol=1)


def quadratic_misfit(mirrors, normals):
    """What a fixed point of the sweeps minimises axis by axis, summed over the samples."""
    normals_at = normals[mirrors.site]
    image = np.einsum("pi,ip->p", normals_at, mirrors.images(normals))
    out_of_plane = np.einsum("pi,ip->p", normals_at, mirrors.direction)
    return float((mirrors.gather @ (1 - image**2 + out_of_plane**2)).sum())


@pytest.fixture(
    scope="module",
    params=[shapes.square(400), shapes.sphere(400), shapes.cylinder(500), shapes.junction(600)],
    ids=["plane", "sphere", "cylinder", "junction"],
)
def both(request):
    """Energy, mirrors, start, and where the sweeps and Adam end from it."""
    points = request.param
    spacing = local_spacing(points)
    samples = bisector_samples(facet_polygons(points, spacing), spacing, 2.0)
    energy, start = NormalEnergy(points, spacing, samples), random_axes(len(points), 7)
    mirrors = Mirrors(points, spacing, samples.facets)
    swept = reflection_sweeps(mirrors, start=start)[0]
    return energy, mirrors, start, swept, minimise(energy.value_and_gradient, start)[0]


def test_sweeps_go_as_low_in_the_energy_as_adam_does_from_the_same_random_start(both):
    """E_d itself has kinks in which Adam gets lower on a cylinder and sticks far above on a plane and a junction."""
    energy, _, start, swept, minimised = both
    at_start, by_sweeps, by_adam = (energy.terms(axes)[0] for axes in (start, swept, minimised))
    assert by_sweeps < by_adam + 0.01 * at_start
    assert by_sweeps < 0.05 * at_start


def test_adam_never_gets_lower_in_what_the_sweeps_minimise(both):
    _, mirrors, start, swept, minimised = both
    at_start, by_sweeps, by_adam = (quadratic_misfit(mirrors, axes) for axes in (start, swept, minimised))
    assert by_sweeps < by_adam + 1e-5 * at_start
    assert by_sweeps < 0.2 * at_start


def test_jump_of_the_projection_distance_is_bounded_by_the_mirror_misfit(both):
    energy, _, start, *_ = both
    height = [np.abs(np.einsum("ki,ki->k", start[at], arm)) for at, arm in
              ((energy.site, energy.from_site), (energy.other, energy.from_other))]  # fmt: skip
    step = energy.from_site - energy.from_other
    axis = unit(step)
    image = start[energy.other] - 2 * np.einsum("ki,ki->k", start[energy.other], axis)[:, None] * axis
    cosine = np.einsum("ki,ki->k", start[energy.site], image)
    bound = np.linalg.norm(energy.from_site, axis=1) * np.sqrt(2 * (1 - cosine**2))
    assert (np.abs(height[0] - height[1]) <= bound + 1e-4).all()


def test_neighbours_are_cut_only_where_enough_are_left():
    mirrors = mirrors_of(shapes.sphere(200))
    own = mirrors.site == 0
    lightest = np.flatnonzero(own)[mirrors.weight[own].argmin()]
    cut = own & (np.arange(len(own)) != lightest)
    assert mirrors.weight[lightest] < 0.1
    np.testing.assert_array_equal(mirrors.without(cut).weight[own], mirrors.weight[own])
    heaviest = np.flatnonzero(own)[mirrors.weight[own].argmax()]
    fewer = mirrors.without(np.arange(len(own)) == heaviest)
    assert fewer.weight[heaviest] == 0
    assert fewer.weight[own].sum() == pytest.approx(1)


def test_where_axes_go_to_and_fro_the_sweeps_end_as_well():
    """Among points without a surface, where axes alternate without an end but for their inertia."""
    points = np.random.default_rng(0).random((300, 3))
    assert sweeps(points)[2] < MAX_SWEEPS
