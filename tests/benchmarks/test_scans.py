"""Scans of shapes whose visible parts are known, and the page on made-up numbers."""

import json
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("matplotlib")
pytest.importorskip("igl")

from benchmarks import noise_measure, scans
from benchmarks.geometry import closest_points
from benchmarks.metrics import surface_errors
from benchmarks.scanners import EYE, IMAGES, before_camera, depth_frame, depth_images, in_room, seen_from_one_spot
from benchmarks.scans import (
    FRAMES,
    ROOM_NOISE,
    ROOM_POINTS,
    SHAPES,
    VOXELS,
    measure_frame,
    measure_images,
    measure_room,
    measure_voxels,
    write_page,
)
from benchmarks.shapes import closed, rooms
from benchmarks.voxels import occupied, segmented
from core import Mesh


def two_squares(gap):
    """A large one at z = 0, a small one `gap` above it."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(np.vstack([corners, 0.4 * corners + [0, 0, gap]]), np.vstack([faces, faces + 4]).astype(np.int32))


def test_points_of_depth_images_lie_on_what_is_seen_and_those_that_fly_between():
    mesh = two_squares(0.6)
    points, flying = depth_images(mesh, 5000, np.random.default_rng(0))
    distance = closest_points(points, mesh)[0]
    assert len(points) == pytest.approx(5000, rel=0.1)
    assert distance[~flying].max() < 1e-6
    assert (distance[flying] > 0.01).mean() > 0.7
    assert ((points[flying, 2] > -0.1) & (points[flying, 2] < 0.7)).all()  # grazing rays see a plane's own slope jump
    assert ((points[flying, 2] > 0.1) & (points[flying, 2] < 0.5)).mean() > 0.1
    assert 0.002 < flying.mean() < 0.1


def test_a_box_is_seen_all_around_and_nothing_flies_outside():
    mesh = closed.cube().mesh
    points, _ = depth_images(mesh, 4000, np.random.default_rng(0))
    assert np.abs(points).max() < 0.4 + 1e-6
    axis = np.abs(points).argmax(axis=1)
    side = np.take_along_axis(points, axis[:, None], 1)[:, 0] > 0
    assert np.bincount(2 * axis + side, minlength=6).min() > 4000 / 6 / 2


def test_a_scan_from_one_spot_sees_each_ray_once_and_its_noise_is_along_rays():
    mesh = rooms.room().mesh
    points, seen = seen_from_one_spot(mesh, 3000, 1.0, np.random.default_rng(0))
    assert len(seen) == pytest.approx(3000, rel=0.1)
    assert closest_points(seen, mesh)[0].max() < 1e-6
    rays = seen - EYE
    depth = np.linalg.norm(rays, axis=1)
    off = np.einsum("ni,ni->n", points - seen, rays / depth[:, None])
    assert np.linalg.norm(points - seen - off[:, None] * rays / depth[:, None], axis=1).max() < 1e-9
    assert off.std() == pytest.approx(0.01 * np.ptp(mesh.vertices, axis=0).max(), rel=0.1)


@pytest.fixture
def squares(monkeypatch):
    """The two squares as a shape, next to peers that crash; errors from few points."""
    surface = SimpleNamespace(mesh=two_squares(0.6))
    monkeypatch.setattr(scans, "CASES", {"squares": SimpleNamespace(surface=lambda: surface)})
    monkeypatch.setattr(scans, "by_peer", lambda *_: {})
    monkeypatch.setattr(noise_measure, "surface_errors", partial(surface_errors, count=2000))


def test_flying_points_found_and_points_lost_are_counted(squares):
    row = measure_images("squares", 6000)
    assert row["found"] > 0.8
    assert row["lost"] < 0.01
    assert row["none"]["cd"] <= row["ours"]["cd"] < row["all"]["cd"]
    assert "poisson" not in row


def test_of_a_noisy_room_next_to_nothing_is_dropped_and_what_is_seen_is_near_the_surface():
    row = measure_room(8000, 0.1)
    assert row["dropped"] < 8
    assert row["to_surface"]["mean"] < row["to_truth"]["mean"] < 3


def test_a_frame_is_in_steps_of_disparity_and_its_pixels_see_the_mesh():
    mesh = before_camera(rooms.room().mesh)
    points, seen = depth_frame(mesh, 40, 2.0, 0.0, np.random.default_rng(0))
    assert closest_points(seen, mesh)[0].max() < 1e-6
    steps = np.median(seen[:, 2]) / (2.0 * 2 * np.tan(np.pi / 6) / 40) / points[:, 2]
    assert np.abs(steps - np.rint(steps)).max() < 1e-6
    np.testing.assert_allclose(points / points[:, 2:], seen / seen[:, 2:])
    assert closest_points(in_room(seen), rooms.room().mesh)[0].max() < 1e-6


def test_steps_of_a_frame_are_smoothed():
    row = measure_frame(4.0, 0.3, width=120)
    assert row["ours"]["points"] < 0.5 * row["as_they_come"]["points"]
    assert row["ours"]["borders"] < 0.5 * row["as_they_come"]["borders"]


def test_voxels_are_those_that_a_surface_meets_or_bounds():
    cube, turn = closed.cube().mesh, Rotation.from_rotvec([0.4, 0.3, 0.2]).as_matrix()
    mesh = replace(cube, vertices=cube.vertices @ turn.T)
    side = np.ptp(mesh.vertices, axis=0).max() / 30
    met = occupied(mesh, 30, np.random.default_rng(0))
    away = closest_points(met, mesh)[0]
    assert away.max() <= 0.5 * np.sqrt(3) * side
    places = np.rint(met / side - 0.5)
    np.testing.assert_allclose(met, side * (places + 0.5), atol=1e-9)
    inside = segmented(mesh, 30)
    depth = 0.4 - np.abs(inside @ turn).max(axis=1)
    assert depth.min() > 0
    assert depth.max() <= 1.01 * side
    area = mesh.face_areas().sum() / side**2
    assert 0.7 * area < len(inside) < 1.3 * area


@pytest.mark.parametrize("kind", ["occupied", "segmented"])
def test_voxels_are_smoothed(kind, monkeypatch):
    monkeypatch.setattr(scans, "by_peer", lambda *_: {})
    monkeypatch.setattr(noise_measure, "surface_errors", partial(surface_errors, count=2000))
    row = measure_voxels(kind, "torus_5k", 24)
    assert row["ours"]["pieces"] == 2
    assert row["ours"]["hd"] < row["as_they_come"]["hd"]
    assert "poisson" not in row


def made_up():
    errors = {"cd": 0.5, "hd": 9.0}
    ways = {"ours": errors, "all": {"cd": 5.0, "hd": 90.0}, "none": errors, "poisson": {"cd": 2.5, "hd": 70.0}}
    row = {"points": 100, "flying": 0.05, "far": 0.0125, "found": 0.99, "lost": 0.002, **ways}
    images = [{"shape": name, **row} for name in SHAPES]
    images[1]["found"] = None
    del images[1]["poisson"]
    off = {"to_surface": {"mean": 0.25, "max": 4.0}, "to_truth": {"mean": 0.5, "max": 6.0}}
    rooms = [{"points": n, "percent": p, "dropped": 3, **off} for n in ROOM_POINTS for p in ROOM_NOISE]
    way = {"points": 0.125, "to_truth": 0.5, "seen": 0.25, "borders": 3, "pieces": 2}
    frames = [
        {"points": 900, "step": s, "noise": n, "ours": way, "as_they_come": {**way, "borders": 90}} for s, n in FRAMES
    ]
    errors = {"cd": 1.5, "hd": 9.0, "pieces": 2}
    ways = {"ours": errors, "as_they_come": {**errors, "pieces": 20}}
    voxels = [{"kind": kind, "shape": name, "across": n, "points": 4000, **ways} for kind, name, n in VOXELS]
    voxels[0]["poisson"] = {"cd": 2.0, "hd": 8.0}
    return {"versions": {"Python": "3.11"}, "images": images, "rooms": rooms, "frames": frames, "voxels": voxels}


def test_page_holds_every_row(tmp_path):
    measured = made_up()
    page = write_page(measured, tmp_path).read_text()
    assert f"| {SHAPES[0]} | 1.25% | 99.0% | 0.20% | 0.500 (9) | 5.000 (90) | 0.500 (9) | 2.500 (70) |" in page
    assert f"| {SHAPES[1]} | 1.25% | – | 0.20% | 0.500 (9) | 5.000 (90) | 0.500 (9) | – |" in page
    assert "| 30,000 | 0.1 | 3 | 0.25 (4) | 0.50 (6) |" in page
    assert "| 900 | 4 | 0.3 | here | 0.12 | 0.50 | 0.25 | 3 | 2 |" in page
    assert "| 900 | 4 | 0.3 | `denoise=0` | 0.12 | 0.50 | 0.25 | 90 | 2 |" in page
    assert "| occupied | bumps_10k | 40 | 4,000 | 1.500 (9) | 2 | 1.500 (9) | 20 | 2.000 (8) |" in page
    assert "| segmented | tangle_10k | 80 | 4,000 | 1.500 (9) | 2 | 1.500 (9) | 20 | – |" in page
    assert f"{IMAGES} depth images" in page
    assert json.loads((tmp_path / "scans" / "numbers.json").read_text()) == measured
