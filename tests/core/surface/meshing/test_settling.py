import numpy as np
import pytest

from core.field.local_surface import fit_local_surface
from core.points import local_spacing
from core.surface.meshing.settling import settled
from tests import shapes
from tests.counted import Counted

CELL = 0.05


@pytest.fixture(scope="module")
def sphere():
    points = shapes.sphere(1500)
    return fit_local_surface(points, points, np.ones(len(points)), local_spacing(points), 3.0)


def test_vertices_come_to_the_surface_from_near_and_far(sphere):
    off = np.tile([0.01, -0.04, 0.5, 1.5], 100) * CELL
    vertices = shapes.scattered_sphere(400) * (1 + off)[:, None]
    before = vertices.copy()
    counted = Counted(sphere)
    moved = settled(vertices, sphere.project(vertices).step, counted, CELL)
    assert counted.count == 200  # the two far ones of each four
    np.testing.assert_array_equal(vertices, before)
    again = sphere.project(moved).distance / CELL
    assert np.percentile(again, 99) < 0.003
    assert shapes.sphere_distance(moved).max() < 0.02 * CELL


def test_the_second_step_brings_far_ones_closer(sphere):
    vertices = shapes.scattered_sphere(300) * 1.2
    step = sphere.project(vertices).step
    once, twice = (sphere.project(x).distance for x in (vertices - step, settled(vertices, step, sphere, CELL)))
    assert twice.mean() < 0.5 * once.mean()
