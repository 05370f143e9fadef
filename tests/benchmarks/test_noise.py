"""The measures behind docs/noise.md on shapes whose truth is known, and the page on made-up numbers."""

import json
import os
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("igl")

from benchmarks import noise_hostile, noise_measure, published
from benchmarks.cases import Case
from benchmarks.geometry import face_normals, surface_samples
from benchmarks.metrics import surface_errors
from benchmarks.noise import main, write_page
from benchmarks.noise_hostile import FILES, POINTS, tried
from benchmarks.noise_measure import (
    CASES,
    MARGIN,
    NOISE,
    SHAPE,
    STRAYS,
    by_peer,
    half_noisy,
    measure_more,
    measure_shifted,
    measure_slight,
    measure_strays,
    measure_walls,
    noisy,
    share_noisy,
    strewn,
)
from benchmarks.noise_silence import silences, stops
from benchmarks.noise_uneven import mixed
from benchmarks.noise_verdicts import verdicts
from benchmarks.noise_wires import CLUSTERED, SHARES, WIRES
from benchmarks.noise_wires import measure as measure_wires
from benchmarks.shapes import closed
from core import Mesh, Settings
from core.cleaning.outliers import find_outliers
from tests import shapes

SQUARE = Mesh(np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def crossed(mesh):
    """The mesh and the same upright."""
    vertices = np.vstack([mesh.vertices, mesh.vertices[:, [2, 0, 1]]])
    return Mesh(vertices, np.vstack([mesh.faces, mesh.faces + len(mesh.vertices)]))


@pytest.fixture
def square():
    points = shapes.square(400)
    return Case("square", points, np.tile([0.0, 0, 1], (400, 1)), SQUARE, np.empty((0, 3)), {"category": "open"})


def test_noise_has_the_deviation_asked_for(square):
    off = noisy(square, 2.0) - square.points
    assert off.std() == pytest.approx(0.02 * np.ptp(square.points, axis=0).max(), rel=0.1)
    np.testing.assert_array_equal(noisy(square, 0.0), square.points)


def test_half_of_a_case_stays_as_it_is(square):
    points, half = half_noisy(square, 2.0)
    assert half.sum() == 200
    np.testing.assert_array_equal(points[~half], square.points[~half])
    np.testing.assert_array_equal(points[half], noisy(square, 2.0)[half])
    assert share_noisy(square) == 0.0
    assert share_noisy(replace(square, points=noisy(square, 2.0))) == 1.0


def test_strays_follow_the_points_and_fill_the_box(square):
    points = strewn(square, 0.5)
    np.testing.assert_array_equal(points[:400], square.points)
    strays = points[400:]
    assert len(strays) == 200
    assert 0.9 < np.abs(strays[:, :2]).max() <= MARGIN
    assert len(strewn(square, 0.0)) == 400


def test_strays_found_and_points_lost_are_told_apart(square, monkeypatch):
    monkeypatch.setattr(noise_measure, "surface_errors", partial(surface_errors, count=2000))
    monkeypatch.setattr(noise_measure, "Settings", partial(Settings, resolution=32))
    upright = square.points[:, [2, 0, 1]]
    crossing = replace(square, points=np.vstack([square.points, upright]), truth=crossed(SQUARE))
    found = measure_strays(crossing, 0.05)
    assert found["found"] > 0.8
    assert found["lost"] < 0.05
    assert found["cd"] < found["untreated_cd"]
    clean = measure_strays(crossing, 0.0)
    assert clean["found"] is None
    assert clean["cd"] == clean["untreated_cd"] < 20


@pytest.mark.parametrize(("measure", "level"), [(measure_slight, 0.08), (measure_shifted, 0.1)])
def test_slight_noise_is_moved_as_all_noise_is_and_so_are_shifted_scans(measure, level, monkeypatch):
    monkeypatch.setattr(noise_measure, "surface_errors", partial(surface_errors, count=2000))
    monkeypatch.setattr(noise_measure, "Settings", partial(Settings, resolution=32))
    truth = closed.torus().mesh
    points, normals = surface_samples(truth, 3000, np.random.default_rng(1))[:2]
    case = Case("torus", points, normals, truth, np.empty((0, 3)), {"category": "watertight"})
    found = measure(case, level)
    assert found["moved"] == 1.0
    assert found["ours"] == found["every"]
    assert found["ours"]["cd"] < found["none"]["cd"]
    assert measure(case, 0.0)["moved"] == 0.0


def test_thin_walls_stay_and_both_sheets_are_the_truth(monkeypatch):
    monkeypatch.setattr(noise_measure, "surface_errors", partial(surface_errors, count=2000))
    monkeypatch.setattr(noise_measure, "Settings", partial(Settings, resolution=64))
    truth = closed.torus().mesh
    points, face = surface_samples(truth, 3000, np.random.default_rng(1))
    case = Case("torus", points, face_normals(truth)[face], truth, np.empty((0, 3)), {"category": "watertight"})
    found = measure_walls(case, 0.5)
    assert found["moved"] == 0.0
    assert found["ours"] == found["none"]
    assert found["ours"]["cd"] < 0.8 * found["every"]["cd"]


def test_more_points_of_the_same_noise_come_closer(monkeypatch):
    monkeypatch.setattr(noise_measure, "surface_errors", partial(surface_errors, count=2000))
    monkeypatch.setattr(
        noise_measure, "reconstruct", partial(noise_measure.reconstruct, settings=Settings(resolution=32))
    )
    monkeypatch.setattr(noise_measure, "by_peer", lambda *_: {})
    truth = closed.torus().mesh
    case = Case("torus", np.empty((0, 3)), np.empty((0, 3)), truth, np.empty((0, 3)), {"category": "watertight"})
    few, many = (measure_more(case, count, 1.0) for count in (1000, 4000))
    assert (many["points"], many["pieces"]) == (4000, 2)
    assert many["before"] == pytest.approx(few["before"], rel=0.1)
    assert many["after"] < 0.8 * few["after"] < 0.64 * few["before"]
    assert many["noise"] == pytest.approx(many["deviation"], rel=0.15)
    assert "poisson" not in many


@pytest.mark.parametrize("name", WIRES)
def test_wires_are_what_they_say_and_lose_nothing_without_strays(name):
    points = WIRES[name](np.random.default_rng(5))
    assert points.shape[1] == 3
    assert not find_outliers(points).any()


def test_strays_among_wires_are_counted():
    runs = measure_wires("a helix, 600")["runs"]
    assert [(run["share"], run["clouds"]) for run in runs] == [(share, False) for share in SHARES] + [(CLUSTERED, True)]
    assert runs[0] == {"share": 0.0, "clouds": False, "found": None, "lost": 0.0}
    assert all(0.5 < run["found"] <= 1 for run in runs[1:])


def test_mixed_densities():
    points = mixed(closed.torus(), np.random.default_rng(0))
    third = np.digitize(points[:, 0], np.percentile(closed_samples()[:, 0], (100 / 3, 200 / 3)))
    assert np.bincount(third) == pytest.approx([67, 333, 1667], rel=0.1)


def closed_samples():
    return surface_samples(closed.torus().mesh, 20_000, np.random.default_rng(1))[0]


def test_silences_count_every_look_and_stops_are_prompt():
    points, settings = shapes.sphere(300), Settings(resolution=16, surface="none")
    stages = silences(points, settings)
    assert list(stages)[:2] == ["start", "cleaning"]
    assert all(found["looks"] >= 1 and found["seconds"] >= 0 for found in stages.values())
    assert sum(found["looks"] for found in stages.values()) > 10
    (found,) = stops(points, settings, length=0.05, count=1)
    assert 0 <= found["stopped"] <= found["gone"] < 5


def test_bad_input_is_tried_and_what_breaks_is_told(monkeypatch):
    monkeypatch.setattr(noise_hostile, "POINTS", {name: POINTS[name] for name in ("3 points", "4 points")})
    monkeypatch.setattr(noise_hostile, "FILES", {name: FILES[name] for name in ("empty .xyz", ".csv of words")})
    rows = {row["given"]: row for row in tried()}
    assert {name: row["outcome"] for name, row in rows.items()} == {
        "3 points": "refused", "4 points": "done", "empty .xyz": "refused", ".csv of words": "refused"
    }  # fmt: skip
    assert rows["empty .xyz"]["got"] == "scan.xyz is empty"

    def broken(*_):
        raise RuntimeError("broken")

    monkeypatch.setattr(noise_hostile, "reconstruct", broken)
    assert [row["outcome"] for row in tried()] == ["crashed", "crashed", "refused", "refused"]


WAYS = "ours", "bridged", "poisson"


def made_up(nc=0.99, cd=0.8, outcome="refused", silence=0.2, said=1.1, lost=0.0):
    way = {"after": 1.0, "nc": nc, "cd": cd, "hd": 10.0, "cpu": 2.0}
    rows = [
        {
            "case": case, "points": 100, "percent": percent, "deviation": 4.0, "before": 3.5,
            "pca": {"nc": 0.98, "k": 12},
            "ours": {**way, "noise": 3.9, "neighbours": [20, 30, 40]},
            "alternating": {**way, "after": 2.0, "changes": [0.4, 0.2]},
            "poisson": {"nc": 0.9, "cd": 1.5, "hd": 60.0, "cpu": 1.0},
        }
        for case in CASES
        for percent in NOISE
    ]  # fmt: skip
    strays = [
        {"case": case, "share": share, "found": 0.99 if share else None, "lost": 0.001, "cd": 0.1 + share, "hd": 9.0,
         "untreated_cd": 5.0, "pieces": 2}
        for case in CASES
        for share in STRAYS
    ]  # fmt: skip
    return {
        "versions": {"Python": "3.11"},
        "hostile": [{"given": "junk", "outcome": outcome, "got": "a|b\x07" + 300 * "c", "seconds": 0.1}],
        "fuzz": {"runs": 3, "done": 2, "refused": 1, "crashed": 0, "not finite": 0, "hung": 0, "seconds": 1.0},
        "clean": {"one, uniform": 0.0, "other, uniform": 0.25},
        "halves": [
            {
                "case": case,
                "percent": 0.5,
                "found": 0.97,
                "falsely": 0.01,
                "before": 3.2,
                "after": 0.9,
                "cd": 0.5,
                "cd_none": 1.4,
                "cd_every": 1.0,
            }
            for case in CASES
        ],
        "strays": strays,
        "wires": [
            {
                "wires": "a helix",
                "runs": [
                    {"share": 0.0, "clouds": False, "found": None, "lost": lost},
                    {"share": 0.05, "clouds": True, "found": 0.81, "lost": 0.002},
                ],
            }
        ],
        "uneven": [{"shape": "a torus", "points": 2000} | {way: {"cd": 0.5, "hd": 9.0} for way in WAYS}],
        "faint": [
            {"case": "one", "part": "cap", "share": 0.04, "level": 0.4, "moved": 0.0, "cd": 0.204, "cd_best": 0.199}
        ],
        "more": [
            {
                "case": "one",
                "points": 30_000,
                "percent": 2.0,
                "deviation": 16.0,
                "noise": 15.84,
                "before": 12.7,
                "after": 2.1,
                "neighbours": [91, 362, 512],
                "pieces": 2,
                "ours": {"cd": 2.1, "hd": 11.2},
            },
        ],
        "slight": [
            {"case": "one", "level": 0.03, "moved": 1.0}
            | {way: {"cd": cd, "hd": 9.4} for way, cd in (("ours", 0.14), ("none", 0.43), ("every", 0.14))}
        ],
        "shifted": [
            {"case": "one", "level": 0.2, "moved": 0.5}
            | {way: {"cd": cd, "hd": 8.4} for way, cd in (("ours", 0.24), ("none", 0.53), ("every", 0.22))}
        ],
        "walls": [
            {"case": "one", "level": 0.7, "moved": 0.0}
            | {way: {"cd": cd, "hd": 7.4} for way, cd in (("ours", 0.54), ("none", 0.54), ("every", 1.22))}
        ],
        "between": [{"case": case, "percent": percent, "cd": 0.625} for case in CASES for percent in published.NOISE],
        "costs": [
            {
                "case": "one",
                "sampling": "uniform",
                "surface": "both",
                "resolution": 512,
                "band": 4.0,
                "cpu_said": 30.0,
                "cpu": 25.0,
                "seconds_said": 60.0,
                "seconds": 50.0,
                "memory_said": said * 100.0,
                "memory": 100.0,
            }
        ],
        "silences": {"clean": {"cleaning": {"looks": 3, "seconds": 0.4, "cpu": 0.3}}},
        "stops": {
            "clean": [{"after": 1.0, "stopped": silence, "gone": 2.5}, {"after": 2.0, "stopped": 0.1, "gone": 0.1}]
        },
        "load": 7.2,
        "noise": rows,
        "categories": dict.fromkeys(CASES, "watertight"),
    }


def test_page_holds_every_row_and_no_raw_bytes(tmp_path):
    measured = made_up()
    page = write_page(measured, tmp_path).read_text()
    for case in CASES:
        assert page.count(f"| {case} |") == 3 * len(NOISE) + 1 + len(STRAYS)
    assert "taken for noisy: 25.0% of other, uniform." in page
    assert "| junk | refused | a·b·ccc" in page
    assert "| a helix | – / 0.0% | 81% / 0.2% |" in page
    assert "| one | 2 | 30,000 | 12.70 → 2.10 | 15.84 / 16.00 | 362 | 2.100 (11) | 2 | – |" in page
    assert "| one | 0.03 | 100% | 0.140 (9) | 0.430 (9) | 0.140 (9) |" in page
    assert "| one | 0.2 | 50% | 0.240 (8) | 0.530 (8) | 0.220 (8) |" in page
    assert "| one | cap | 4% | 0.4 | 0% | 0.204 | 0.199 |" in page
    assert "| one | uniform | both | 512, band 4 | 30.0 | 25.0 | 1.20 | 110 | 100 | 1.10 |" in page
    assert "| 0.3 % noise | 0.62 | 0.62 | 0.62 | 1.20 | – |" in page
    assert "| clean | 2 | 0.20 | 2.50 |" in page
    assert "c …" in page
    assert (tmp_path / "noise" / "noise.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "noise" / "numbers.json").read_text())["fuzz"] == measured["fuzz"]


def test_peers_that_crash_are_left_out(tmp_path, capfd):
    assert by_peer(os._exit, 3) == {}
    assert "crashed with exit code 3" in capfd.readouterr().out
    assert by_peer(dict, ((1, 2),)) == {1: 2}

    measured = made_up()
    for row in measured["noise"][:2] + measured["uneven"]:
        del row["poisson"]
    page = write_page(measured, tmp_path).read_text()
    assert f"| {CASES[0]} | {NOISE[0]:g} | 0.9900 | 0.9800 | 12 | 0.9900 | – |" in page
    assert "| a torus | 2,000 | 0.500 (9) | 0.500 (9) | – |" in page
    assert "Poisson 0.50 ×" in page


@pytest.mark.parametrize(
    ("change", "missed"),
    [
        ({}, ["with 5 % of strays"]),
        ({"nc": 0.98}, [f"{SHAPE} at 0.5 %: NC", "with 5 % of strays"]),
        ({"cd": 1.0}, [f"{SHAPE} at 0.5 %: CD", "with 5 % of strays"]),
        ({"outcome": "hung"}, ["with 5 % of strays", "of 1 bad inputs"]),
        ({"silence": 1.5}, ["with 5 % of strays", "a cancelled run"]),
        ({"said": 1.5}, ["with 5 % of strays", "the memory said"]),
        ({"lost": 0.01}, ["with 5 % of strays", "of wires without strays"]),
    ],
)
def test_verdicts_follow_the_numbers(change, missed):
    lines = [line for line in verdicts(made_up(**change)) if line.startswith("**Missed**")]
    assert len(lines) == len(missed)
    assert all(any(part in line for line in lines) for part in missed)


def test_an_empty_folder_is_refused_in_a_line(tmp_path, capsys):
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
