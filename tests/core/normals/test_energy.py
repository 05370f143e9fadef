import doctest

import numpy as np
import pytest

from core.normals import energy as module
from core.normals.energy import EnergyWeights, NormalEnergy
from core.normals.energy_torch import torch_value_and_gradient
from core.points import local_spacing
from core.voronoi.bisectors import BisectorSamples, bisector_samples
from core.voronoi.facets import Facets
from core.voronoi.polygons import facet_polygons
from tests import shapes
from tests.shapes import scattered_sphere as random_axes

EACH = [EnergyWeights(1, 0, 0), EnergyWeights(0, 1, 0), EnergyWeights(0, 0, 1), EnergyWeights(1, 0.1, 0.5)]


def energy_of(points, weights=EnergyWeights(), printed=False):
    spacing = local_spacing(points)
    samples = bisector_samples(facet_polygons(points, spacing), spacing, 2.0)
    return NormalEnergy(points, spacing, samples, weights, printed)


def test_documented_example():
    assert doctest.testmod(module).failed == 0
    assert doctest.testmod(module).attempted > 0


def test_terms_by_hand():
    """Two samples a unit apart, one sample of weight 3 on their bisector, a unit above their midpoint."""
    points = np.array([[0.0, 0, 0], [1, 0, 0]])
    facets = Facets(np.array([[0, 1]]), np.array([3.0]))
    samples = BisectorSamples(facets, np.array([[0.5, 0, 1]]), np.array([0]), np.array([3.0]))
    normals = np.array([[0.0, 0, 1], [0.6, 0, 0.8]])
    energy = NormalEnergy(points, np.ones(2), samples)
    gap, turn = 1 - (0.8 - 0.3), np.linalg.norm([0.6, 0, -0.2])
    np.testing.assert_allclose(energy.terms(normals), [3 * gap, 3 * turn, 0.36], rtol=1e-12)
    printed = NormalEnergy(points, np.ones(2), samples, printed_alignment=True)
    np.testing.assert_allclose(printed.terms(normals), [3 * gap, 3 * turn, 1 + 1.6**2], rtol=1e-12)

    doubled = NormalEnergy(2 * points, np.full(2, 2.0), BisectorSamples(
        Facets(facets.pairs, 4 * facets.area), 2 * samples.positions, samples.facet, 4 * samples.weight
    ))  # fmt: skip
    np.testing.assert_allclose(doubled.terms(normals), energy.terms(normals), rtol=1e-12)


@pytest.mark.parametrize("printed", [False, True])
@pytest.mark.parametrize("weights", EACH, ids=["E_d", "E_g", "E_align", "E"])
def test_gradient_is_that_of_finite_differences(weights, printed, random):
    energy = energy_of(shapes.junction(120), weights, printed)
    normals = random_axes(120, 3)
    _, gradient = energy.value_and_gradient(normals)
    for _ in range(5):
        direction = random.normal(size=normals.shape)
        ahead, behind = (energy.value_and_gradient(normals + s * 1e-7 * direction)[0] for s in (1, -1))
        slope = (gradient * direction).sum()
        assert (ahead - behind) / 2e-7 == pytest.approx(slope, rel=1e-4, abs=1e-3 * np.abs(gradient).max())


@pytest.mark.parametrize("printed", [False, True])
@pytest.mark.parametrize("weights", EACH, ids=["E_d", "E_g", "E_align", "E"])
def test_torch_agrees_with_numpy(weights, printed):
    pytest.importorskip("torch")
    energy = energy_of(shapes.torus(300), weights, printed)
    normals = random_axes(300, 1)
    value, gradient = energy.value_and_gradient(normals)
    other_value, other_gradient = torch_value_and_gradient(energy)(normals)
    assert other_value == pytest.approx(value, rel=1e-6)
    np.testing.assert_allclose(other_gradient, gradient, atol=1e-6 * np.abs(gradient).max())


def test_true_axes_have_no_jump_on_a_plane_and_on_a_sphere():
    plane, sphere = shapes.square(300), shapes.scattered_sphere(300)
    np.testing.assert_allclose(energy_of(plane).terms(np.tile([0.0, 0, 1], (300, 1))), 0, atol=1e-9)
    energy = energy_of(sphere)
    assert energy.terms(sphere)[0] < 1e-4 * energy.terms(random_axes(300, 1))[0]


def test_signs_motion_and_scale_do_not_matter(random):
    points, normals = shapes.moebius(300), random_axes(300, 2)
    energy = energy_of(points)
    signs = random.choice([-1.0, 1.0], 300)[:, None]
    np.testing.assert_allclose(energy.terms(signs * normals), energy.terms(normals), rtol=1e-12)
    turn = shapes.random_rotation(3)
    moved = energy_of(9 * points @ turn.T + 1)
    np.testing.assert_allclose(moved.terms(normals @ turn.T), energy.terms(normals), rtol=0.02)


def test_printed_alignment_pulls_axes_of_a_border_into_the_surface():
    """At a straight border the least (1 - n.d)^2 lies in the plane, the least (n.d)^2 across it."""
    points = np.array([[0.0, 0, 0], [1, 0.9, 0], [1.0, 0, 0], [1, -0.9, 0], [0, 1, 0], [0, -1, 0]])
    inward, across = np.tile([1.0, 0, 0], (6, 1)), np.tile([0.0, 0, 1], (6, 1))
    corrected = energy_of(points, EnergyWeights(0, 0, 1))
    printed = energy_of(points, EnergyWeights(0, 0, 1), printed=True)
    owner = corrected.owner == 0

    def own(energy, axes):
        cosine = np.einsum("ai,ai->a", axes[energy.owner], energy.direction)[owner]
        return ((cosine - (1 if energy.printed_alignment else 0)) ** 2).sum()

    assert own(printed, inward) < own(printed, across)
    assert own(corrected, across) < own(corrected, inward)
