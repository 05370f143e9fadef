import numpy as np
import pytest

from core import Settings, reconstruct
from core.field.patches import Patches
from core.field.rims import line_gaps
from core.field.rims.borders import find_rims
from core.field.rims.line_gaps import with_line_gaps_bridged
from core.neighbourhoods.cloud import Cloud
from core.points import local_spacing
from tests import shapes

UP = np.array([0.0, 0.0, 1.0])
APART = 0.1  # of the lines
PLACES = np.arange(12) * APART


def before_and_after(points, normals=UP):
    cloud = Cloud.of(points, np.broadcast_to(normals, points.shape), local_spacing(points))
    rims = find_rims(cloud, np.zeros((len(points), 3, 3)), 3.0)
    return rims, with_line_gaps_bridged(rims, cloud, 3.0), cloud.spacing


def lines(random, along=120, places=PLACES):
    """Random points on lines of length 1 at `places`, in the plane z = 0."""
    across = np.repeat(places, along)
    return np.stack([across, random.random(len(across)), np.zeros(len(across))], axis=1)


def inside(points):
    return (points[:, 1] > 0.1) & (points[:, 1] < 0.9)


def test_lines_are_joined_to_either_side(random):
    points = lines(random)
    before, after, spacing = before_and_after(points)
    line = np.rint(points[:, 0] / APART).astype(int)
    between = inside(points) & (line > 0) & (line < PLACES.size - 1)
    assert 4 * np.median(spacing) < APART
    assert before.bridged[between].mean() < 0.1
    both = np.stack([after.bridged, after.behind > 0], axis=1)
    assert both[between].mean() > 0.9
    covered = np.stack([after.reach, after.behind], axis=1)[between][both[between]]
    assert (covered > 0.5 * APART).all()


def test_past_the_outermost_lines_nothing_is_covered(random):
    points = lines(random)
    _, after, spacing = before_and_after(points)
    own = np.flatnonzero(inside(points) & (points[:, 0] > PLACES[-1] - 0.5 * APART))
    assert len(own) > 80
    for way, covered in ((0.5, 0.0), (-0.5, 1.0)):
        steps = np.tile([[way * APART, 0.0, 0.0]], (len(own), 1))
        beyond, _ = Patches.of(after).excess(own[:, None], steps.T[:, :, None], spacing[own][:, None])
        assert np.mean(beyond[:, 0] < 1e-9) == pytest.approx(covered, abs=0.1)


def test_patches_cover_the_gap_behind_and_no_more(random):
    points = lines(random)
    _, rims, spacing = before_and_after(points)
    own = int(np.flatnonzero(inside(points) & (rims.behind > 0) & ~rims.bridged)[0])
    steps = rims.behind[own] * np.array([-0.9, -1.2, 0.9])[:, None] * rims.outward[own]
    sample = np.full((3, 1), own)
    beyond, _ = Patches.of(rims).excess(sample, steps.T[:, :, None], spacing[sample])
    assert beyond[0] == 0
    assert beyond[1] == pytest.approx(0.2 * rims.behind[own])
    assert beyond[2] > 0.3 * rims.behind[own]


def test_a_gap_much_wider_than_those_between_other_lines_stays_open(random):
    middle, wide = 0.6, PLACES + np.where(PLACES > 0.55, APART, 0)
    points = lines(random, along=100, places=wide)
    _, after, spacing = before_and_after(points)
    assert 0.9 * line_gaps._FURTHER * 3.0 * np.median(spacing) > 2 * APART
    beside = inside(points) & (np.abs(points[:, 0] - middle) < 1.1 * APART)
    towards = after.outward[:, 0] * (middle - points[:, 0]) > 0
    assert beside.sum() > 150
    assert not (after.bridged & beside & towards).any()
    assert not ((after.behind > 0) & beside & ~towards & after.gap).any()


@pytest.mark.parametrize("width", [3.5, 6.0])
def test_strips_of_a_few_spacings_are_no_lines(width, random):
    """A sheet with slits that are half as wide again as the strips between them."""
    points = np.pad(random.random((6000, 2)), ((0, 0), (0, 1)))
    spacing = np.median(local_spacing(points))
    points[:, 0] += 1.5 * width * spacing * np.floor(points[:, 0] / (width * spacing))
    before, after, _ = before_and_after(points)
    assert before.open.sum() > 1000
    assert (after.bridged & ~before.bridged)[inside(points)].mean() < 0.01
    assert (after.behind > 0)[inside(points)].mean() < 0.01


@pytest.mark.parametrize("points", [shapes.hemisphere(3000), shapes.scattered_sphere(3000)], ids=["open", "scattered"])
def test_on_sheets_nothing_changes(points):
    before, after, _ = before_and_after(points, points)
    np.testing.assert_array_equal(after.bridged, before.bridged)
    np.testing.assert_array_equal(after.reach, before.reach)
    assert not after.behind.any()


def test_looking_across_some_gaps_at_a_time_changes_nothing(random, monkeypatch):
    points = lines(random)
    whole = before_and_after(points)[1]
    monkeypatch.setattr(line_gaps, "_CHUNK", 7)
    few = before_and_after(points)[1]
    for name in ("bridged", "reach", "behind"):
        np.testing.assert_array_equal(getattr(few, name), getattr(whole, name))


def test_a_cage_of_wires_gives_a_closed_surface():
    points = shapes.scattered_sphere(200_000)
    planes = np.linspace(-0.9, 0.9, 9)
    points = points[(np.abs(points[:, :, None] - planes) < 0.0015).any(axis=(1, 2))][:6000]
    result = reconstruct(points, Settings(resolution=64, surface="single"))
    assert result.report["meshes"]["single"]["borders"] == 0
    assert result.report["meshes"]["single"]["pieces"] == 1
    off = np.abs(np.linalg.norm(result.sheet.vertices, axis=1) - 1)
    assert off.mean() < 0.002
    assert off.max() < 0.05
