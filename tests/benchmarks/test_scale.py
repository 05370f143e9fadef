"""The page on large grids says what was measured, and no more."""

import json

import pytest

from benchmarks import detail, scale
from benchmarks.catalogue import make_case
from benchmarks.scale import COUNTS, POINTS, RUNS, verdicts, write_page


def made_up():
    """Runs whose CPU time grows as resolution^2 and points^0.5, and whose estimates are a tenth too high."""
    runs = []
    for points, resolution, band, surface in RUNS:
        cpu = resolution**2 * points**0.5 / 1e6
        peak = resolution**2 / 400
        runs.append(
            dict(points=points, resolution=resolution, band=band, surface=surface, seconds=cpu, cpu=cpu)
            | dict(field_cpu=cpu / 2, peak_memory_mb=peak, nodes=10, box=1000, faces=7)
            | dict(estimate=dict(seconds=1.0, memory_mb=1.1 * peak))
        )
    peers = [dict(points=count, seconds=1.0, cpu=2.0, peak_memory_mb=50.0) for count in COUNTS]
    rows = [
        dict(case=case, apart=apart, resolution=100, cd=cd / apart)
        for case, cd in (("a", 1), ("b", 2))
        for apart in detail.APART
    ]
    return {"versions": {"Python": "3"}, "runs": runs, "open3d": peers, "detail": rows}


def test_the_page_shows_every_run_and_the_growth(tmp_path):
    text = write_page(made_up(), tmp_path).read_text()
    assert json.loads((tmp_path / "scale" / "numbers.json").read_text())["versions"] == {"Python": "3"}
    assert text.count("| double |") == sum(surface == "double" for *_, surface in RUNS)
    assert "power of **2.00** (field) and **2.00** (whole run)" in text
    assert "number of points to the power of **0.50**" in text
    assert "| 1024^3 | 4 |" in text


def test_detail_is_shown_by_case_and_compared(tmp_path):
    text = write_page(made_up(), tmp_path).read_text()
    assert "| case | 0.75 | 1 | **1.5** | 2 | 3 |" in text
    assert "| b | 2.667 (100) | 2.000 (100) | 1.333 (100) | 1.000 (100) | 0.667 (100) |" in text
    assert "is 0.67 to 0.67 of that at one, and at 3 cells 0.50 to 0.50 of that at 1.5" in text


def test_detail_is_measured_where_points_are_so_far_apart(tmp_path):
    path = make_case(tmp_path, "hemisphere_2k")
    coarse, fine = (detail.detail(path, apart) for apart in (0.75, 1.5))
    assert fine["resolution"] == pytest.approx(2 * coarse["resolution"], abs=1)
    assert 0 < fine["cd"] < coarse["cd"]


def test_verdicts_follow_the_numbers():
    assert [line.split(":")[0] for line in verdicts(made_up())] == ["**Met**"] * 4
    worse = made_up()
    for run in worse["runs"]:
        if run["resolution"] == 1024:
            run["cpu"] *= 4
        if run["resolution"] == 512:
            run["peak_memory_mb"] = 5000.0
    assert [line.split(":")[0] for line in verdicts(worse)] == ["**Met**", "**Missed**", "**Missed**", "**Missed**"]


def test_growth_and_targets_are_read_from_runs_that_are_made():
    made = {(points, resolution, band, surface) for points, resolution, band, surface in RUNS}
    needed = {(POINTS, grid, 4, "double") for grid in scale.GRIDS} | {(count, 512, 4, "double") for count in COUNTS}
    assert needed | {(POINTS, 256, None, "double")} <= made


def test_a_folder_without_the_case_is_refused(tmp_path, capsys):
    pytest.importorskip("open3d", exc_type=ImportError)
    assert scale.main([str(tmp_path)]) == 2
    assert "holds no .npz case" in capsys.readouterr().err
