import numpy as np
import pytest

from benchmarks.alternation import MAX_ROUNDS, SETTLED, OffsetEnergy, alternate, best_moves, largest_changes
from core import Cancelled, Settings
from core.normals.energy import EnergyWeights
from core.points import local_spacing
from core.voronoi.bisectors import bisector_samples
from core.voronoi.polygons import facet_polygons
from tests import shapes


def noisy(points, share, seed=7):
    """Points off by this share of the local spacing."""
    return points + np.random.default_rng(seed).normal(size=points.shape) * share * np.median(local_spacing(points))


def energy_of(points, normals, given=None, **kwargs):
    spacing = local_spacing(points)
    samples = bisector_samples(facet_polygons(points, spacing), spacing)
    return OffsetEnergy(points, normals, spacing, samples, points if given is None else given, **kwargs)


@pytest.mark.parametrize("term", ["distance", "alignment", "regularisation"])
def test_each_gradient_is_that_of_its_term(random, term):
    points = noisy(shapes.torus(150), 0.2)
    axes = random.normal(size=points.shape)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    weights = EnergyWeights(distance=float(term == "distance"), gradient=0.0, alignment=float(term == "alignment"))
    energy = energy_of(
        points, axes, noisy(points, 0.1), weights=weights, regularisation=float(term == "regularisation")
    )
    moves, direction = 0.2 * random.normal(size=(2, len(points)))
    step = 1e-7
    ahead, behind = (energy.value_and_gradient(moves + sign * step * direction)[0] for sign in (1, -1))
    _, gradient = energy.value_and_gradient(moves)
    assert (ahead - behind) / (2 * step) == pytest.approx(gradient @ direction, rel=1e-4)


def test_terms_are_what_they_say(random):
    """By loops over the samples of the bisectors, from the formulas."""
    points = noisy(shapes.torus(60), 0.2)
    given, moves = noisy(points, 0.1), 0.2 * random.normal(size=len(points))
    axes = random.normal(size=points.shape)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    spacing = local_spacing(points)
    samples = bisector_samples(facet_polygons(points, spacing), spacing)
    place = points + (spacing * moves)[:, None] * axes
    expected = 0.0
    for x, facet, area in zip(samples.positions, samples.facet, samples.weight, strict=True):
        i, j = samples.facets.pairs[facet]
        unit = (spacing[i] + spacing[j]) / 2
        gap = abs(axes[i] @ (x - place[i])) - abs(axes[j] @ (x - place[j]))
        expected += area / (unit * np.linalg.norm(points[j] - points[i])) * abs(gap) / unit
    energy = OffsetEnergy(points, axes, spacing, samples, given)
    distance, alignment, regular = energy.terms(moves)
    assert distance == pytest.approx(expected)
    step = place[energy.near] - place[energy.owner]
    cosine = np.einsum("pi,pi->p", step, axes[energy.owner]) / np.linalg.norm(step, axis=1)
    assert alignment == pytest.approx((cosine**2).sum())
    assert regular == pytest.approx((((place - given) / spacing[:, None]) ** 2).sum() + (moves**2).sum())


def test_samples_of_a_plane_stay_and_one_off_it_returns():
    plane = shapes.square(400)
    up = np.tile([0.0, 0.0, 1.0], (len(plane), 1))
    assert np.abs(best_moves(plane, up, plane)).max() < 1e-9
    lifted = plane.copy()
    middle = np.linalg.norm(plane, axis=1).argmin()
    lifted[middle, 2] = 0.5 * local_spacing(plane)[middle]
    moved = lifted + best_moves(lifted, up, lifted)
    assert moved[middle, 2] < 0.35 * lifted[middle, 2]


@pytest.mark.parametrize("solver", ["energy", "reflection"])
@pytest.mark.parametrize("surface", ["sphere", "square"])
def test_noise_is_reduced(solver, surface):
    points = {"sphere": shapes.scattered_sphere(300), "square": shapes.square(300)}[surface]
    distance = {"sphere": shapes.sphere_distance, "square": shapes.square_distance}[surface]
    points = noisy(points, 0.4)
    moved, axes, changes = alternate(points, Settings(solver=solver, backend="numpy"))
    assert np.abs(distance(moved)).mean() < 0.6 * np.abs(distance(points)).mean()
    assert np.linalg.norm(axes, axis=1) == pytest.approx(1.0)
    assert len(changes) < MAX_ROUNDS
    assert changes[-1] < SETTLED
    assert all(change >= SETTLED for change in changes[:-1])


def test_changes_of_axes_forget_their_signs():
    axes = np.tile([0.0, 0.0, 1.0], (20, 1))
    turned = -axes
    assert largest_changes(axes, turned) == 0.0
    turned[3] = [1.0, 0.0, 0.0]
    assert largest_changes(axes, turned) == pytest.approx(np.sqrt(2) / 2)


def test_can_be_cancelled():
    with pytest.raises(Cancelled):
        alternate(noisy(shapes.scattered_sphere(200), 0.3), Settings(), lambda fraction, text: fraction < 0.2)
