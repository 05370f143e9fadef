import numpy as np
import pytest

from core.cleaning.clean import clean
from core.cleaning.filled import bounds_volume, fills_volume
from core.pipeline import reconstruct
from core.points import local_spacing, prepare_samples
from core.settings import Settings
from tests import shapes


def filled(inside, n, seed=0):
    """The first n of random points of the cube [-1,1]^3 that are inside."""
    points = np.random.default_rng(seed).uniform(-1, 1, (60 * n, 3))
    return points[inside(points)][:n]


def in_ball(points):
    return np.linalg.norm(points, axis=1) < 1


def in_shell(points):
    return in_ball(points) & (np.linalg.norm(points, axis=1) > 0.55)


def in_torus(points):
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 0.65, points[:, 2]) < 0.3


def particles():
    """On a jittered grid, as those of fluids."""
    grid = np.stack(np.meshgrid(*3 * [np.arange(12.0)], indexing="ij"), axis=-1).reshape(-1, 3)
    return grid + np.random.default_rng(0).uniform(-0.3, 0.3, grid.shape)


SOLIDS = {
    "ball": filled(in_ball, 3000),
    "few": filled(in_ball, 600),
    "shell": filled(in_shell, 6000),
    "torus": filled(in_torus, 2500),
    "particles": particles(),
}
EULER = {"ball": 4, "few": 4, "shell": 8, "torus": 0, "particles": 4}  # of both layers of all boundaries


def with_noise(points, spacings):
    noise = np.random.default_rng(0).normal(size=points.shape)
    return points + spacings * np.median(local_spacing(points)) * noise


@pytest.mark.parametrize("name", SOLIDS)
def test_boundaries_of_filled_solids_are_taken(name):
    run = reconstruct(SOLIDS[name], Settings(resolution=48))
    assert shapes.euler(run.surface) == EULER[name]
    assert len(run.points) < 0.5 * len(SOLIDS[name])
    assert "points lie inside a volume that they fill: its boundary alone is taken" in " ".join(run.report["warnings"])


@pytest.mark.parametrize("noise", [0.05, 0.2])
def test_many_sheets_side_by_side_are_no_solid(noise):
    rng, gap = np.random.default_rng(0), 2.5 * np.sqrt(12 / 6000)
    points = with_noise(np.column_stack([rng.random((6000, 2)), gap * rng.integers(0, 12, 6000)]), noise)
    assert not fills_volume(points, 64, seed=0)[0]
    found, done = clean(prepare_samples(points))
    assert done["noisy"] > 5900
    assert len(found.points) > 5900
    turn = np.exp(2j * np.pi * found.points[:, 2] * found.scale / gap)
    assert abs(turn.mean()) > 0.9


def test_boundary_of_ball_is_its_outermost_samples():
    points = SOLIDS["ball"]
    bounds = bounds_volume(points, local_spacing(points), seed=0)
    radius = np.linalg.norm(points, axis=1)
    assert radius[bounds].min() > 0.7
    assert bounds[radius > 0.98].mean() > 0.9


def test_samples_inside_stay_where_asked_for():
    found, _ = clean(prepare_samples(SOLIDS["ball"]), Settings(outliers=False))
    assert len(found.points) == 3000
    assert found.warnings[0].startswith("points fill a volume: the surface through them is a guess")


def test_what_is_denser_on_one_side_is_told_to_be_filled():
    points = filled(in_ball, 8000)
    points = points[np.random.default_rng(1).random(len(points)) < 0.5 * (points[:, 0] + 1.1)]
    found, _ = clean(prepare_samples(points))
    assert len(found.points) > 0.95 * len(points)
    assert any("points fill a volume" in said for said in found.warnings)


@pytest.mark.parametrize("spacings", [1.0, 2.0])
@pytest.mark.parametrize("shape", [shapes.scattered_sphere, shapes.moebius, shapes.cylinder])
def test_noise_on_surfaces_fills_none(shape, spacings):
    found, done = clean(prepare_samples(with_noise(shape(2000), spacings)))
    assert done["noisy"] > 1800
    assert "points look noisy: they were moved by" in found.warnings[-1]


def test_noise_fills_as_far_as_it_reaches():
    """Neighbours that reach past noise see a surface; those amid it cannot."""
    points = with_noise(shapes.scattered_sphere(40_000), 4.0)
    assert not fills_volume(points, 1000, seed=0)[0]
    assert fills_volume(points, 64, seed=0)[0]
