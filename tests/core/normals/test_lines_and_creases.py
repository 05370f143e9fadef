"""Lines of a scanner that run along creases and across them: points lie closer along lines than these do."""

import numpy as np
import pytest

from core import Settings, reconstruct
from core.normals.estimate import estimate_normals
from core.points import local_spacing
from tests import shapes
from tests.core.normals.test_creases import degrees

SIZE = (1.0, 0.8, 0.6)
DIRECTIONS = {  # and the share of axes beside edges that may be off
    "across an edge": ((1, 0, 0), 0.01),
    "along one": ((1, 1, 0), 0.08),
    "of a corner": ((1, 1, 1), 0.1),
    "any": ((1, 0.5, 0.23), 0.14),
}


def axes_of(points):
    turn = shapes.random_rotation(1)
    return estimate_normals(points @ turn.T, local_spacing(points))[0] @ turn


@pytest.mark.parametrize("ratio", [2, 4, 6])
@pytest.mark.parametrize(("direction", "share"), DIRECTIONS.values(), ids=DIRECTIONS)
def test_axes_beside_the_edges_of_a_box_are_those_of_its_faces(direction, share, ratio):
    """Half to all of the last lines before edges were off by more than 5 degrees at four times, by up to 45 of them."""
    step = 0.035 / np.sqrt(ratio)
    points, normals = shapes.cut_box(direction, step, ratio * step, SIZE)
    to_faces = np.minimum(points, np.subtract(SIZE, points))[:, normals.any(axis=0)]
    beside = np.sort(to_faces, axis=1)[:, 1] < ratio * step
    off = degrees(axes_of(points), normals)
    assert (off[~beside] > 5).mean() < 0.02
    assert (off[beside] > 5).mean() < share
    assert np.median(off[beside]) < 1


@pytest.mark.parametrize("ratio", [2, 3])
def test_a_seat_at_the_foot_of_a_wall(ratio):
    """Its first line has a row of the wall much closer than its second one: a plane through both, but no more."""
    x, wall = np.arange(0, 1.6, 0.045), np.arange(0.02, 0.45, 0.045)
    lines = np.arange(0.02, 0.9, 0.045 * ratio)[:, None]
    shift = 0.017 * (np.arange(len(lines)) % 3)[:, None]
    seat = np.stack([x + shift, lines + 0 * x, 0 * x + 0 * lines], axis=-1).reshape(-1, 3)
    back = np.stack(np.meshgrid(x, [0.0], wall, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.concatenate([seat, back])
    off = degrees(axes_of(points), np.where(points[:, 2:] == 0, [[0, 0, 1.0]], [[0, 1.0, 0]]))
    assert off[(points[:, 0] > 0.1) & (points[:, 0] < 1.5) & (points[:, 1] < 0.5)].max() < 2


@pytest.mark.parametrize("ratio", [3, 5])
def test_a_wavy_sheet_does_not_lie_in_the_planes_that_its_lines_were_cut_by(ratio):
    """Its axes were those of these planes, 43 degrees off on average, and its layer had 80 to 180 borders."""
    step, rng = 0.03 / np.sqrt(ratio), np.random.default_rng(1)
    y = np.arange(-1, 1, ratio * step)[:, None]
    x = np.arange(-1, 1, step) + step * rng.random(y.shape)
    points = np.stack([x, y + 0 * x, 0.15 * np.sin(15 * x + 10.5 * y)], axis=-1).reshape(-1, 3)
    slope = 0.15 * 15 * np.cos(15 * points[:, 0] + 10.5 * points[:, 1])
    normals = np.stack([-slope, -0.7 * slope, np.ones(len(slope))], axis=1)
    axes = axes_of(points)
    assert degrees(axes, normals / np.linalg.norm(normals, axis=1, keepdims=True)).mean() < 8
    run = reconstruct(points, Settings(resolution=96, surface="single"))
    assert run.sheet.border_loops() == 1
    assert len(shapes.components(run.sheet)) == 1


@pytest.mark.parametrize("ratio", [3, 6])
def test_a_box_of_lines_has_its_edges(ratio):
    """Edges were cut off: on average the surface was .017 to .02 of the way to the next line off."""
    between, size = 0.05, np.array([1.0, 0.8, 0.6])
    points, _ = shapes.cut_box((1, 1, 1), between / ratio, between)
    mesh = reconstruct(points, Settings(resolution=64, surface="single")).sheet
    beyond = np.abs(mesh.vertices - size / 2) - size / 2
    off = np.where((beyond < 0).all(axis=1), -beyond.max(axis=1), np.linalg.norm(np.maximum(beyond, 0), axis=1))
    assert off.mean() < 0.007 * between
