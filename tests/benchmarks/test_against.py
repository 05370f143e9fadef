"""What a comparison adds up to, on made-up results; and each peer that is installed, on a sphere."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.against import alone_section, best_peer, full_table, overview, peer_tables, verdicts, ways
from benchmarks.alone import time_alone
from benchmarks.measure_peers import measure_peers
from benchmarks.peers import PEERS, check_open3d, peer_libraries
from benchmarks.plots import plot_cd
from benchmarks.starts import USUAL, Start, readied, starts
from core import Mesh, MissingDependency, Settings


def measures(cd, **more):
    return {"cd": cd, "hd": 10 * cd, "nc": 0.9, "seconds": 1.0, "cpu": 1.5, "memory_mb": 5.0, "variant": None, **more}


def result(case, double, single, category="open", **peers):
    return {
        "case": case,
        "category": category,
        "mesh": measures(double),
        "sheet": measures(single),
        "seconds": {"total": 2.0, "cpu": 3.0},
        "memory_mb": 7.0,
        "peers": {name: measures(cd) if isinstance(cd, float) else {"error": cd} for name, cd in peers.items()},
    }


def test_verdicts_follow_the_numbers():
    good = [result(f"c{k}", 1.0, 1.0, poisson=2.0, front=3.0) for k in range(9)]
    lines = list(verdicts([*good, result("edge", 1.2, 0.9, poisson=1.0)]))
    assert lines[0].startswith("**Met**: VAD, double cover: the lowest CD on 9 of 10 clean cases (90%;")
    assert "at worst 1.20 × the best peer's, on edge" in lines[0]
    assert lines[1].startswith("VAD, single layer: the lowest CD on 10 of 10")
    assert lines[2].startswith(
        "VAD, double cover, of these 10 by the other measures: the lowest HD on 9, the highest NC"
    )
    assert lines[3:] == ["Lost: edge: CD 1.200, single layer 0.900, Poisson 1.000."]
    assert next(verdicts([*good, result("bad", 1.4, 1.4, poisson=1.0)])).startswith("**Missed**")
    assert next(verdicts([good[0], result("few", 1.1, 1.1, poisson=1.0)])).startswith("**Missed**")


def test_a_finer_grid_counts_where_it_was_measured():
    big = {**result("big", 1.5, 1.2, poisson=1.0), "fine": measures(0.5, variant="256 cells")}
    lines = list(verdicts([result("a", 1.0, 1.0, poisson=2.0), big]))
    assert lines[0].startswith("**Missed**: VAD, double cover: the lowest CD on 1 of 2")
    assert lines[2].startswith(
        "VAD, double cover, on a grid twice as fine where it is measured (big): the lowest CD on 2"
    )
    rows = overview([result("a", 1.0, 1.0, poisson=2.0), big]).splitlines()
    assert rows[2] == "| a | **1.000** | **1.000** | – | 2.000 | 0.50 |"
    assert rows[3] == "| big | 1.500 | 1.200 | **0.500** | 1.000 | 1.50 |"
    assert "| big | VAD, double cover, finer grid | 256 cells | 0.500 |" in full_table([big])


def test_spoiled_cases_count_for_nothing_but_are_shown():
    lines = list(verdicts([result("a", 1.0, 1.0, poisson=2.0), result("n", 3.0, 2.0, "noisy", alpha=1.0)]))
    assert "1 of 1 clean cases" in lines[0]
    assert lines[3] == "Lost: n, noisy: CD 3.000, single layer 2.000, alpha shape 1.000."


def test_other_measures_count_against_every_peer():
    ours, theirs = {"nc": 0.9, "f005": 0.8, "f010": 1.0}, {"nc": 0.95, "f005": 0.7, "f010": 1.0}
    case = result("a", 1.0, 1.0, poisson=2.0, front=3.0)
    case["mesh"] |= ours
    case["peers"]["front"] |= theirs
    said = next(line for line in verdicts([case]) if "other measures" in line)
    assert said.endswith("the lowest HD on 1, the highest NC on 0, the highest F@.005 on 1, the highest F@.010 on 1.")


def test_a_case_that_no_peer_ended_is_shown_and_not_counted():
    room = result("room", 1.0, 1.0, poisson="not done after 400 s")
    room["peers"]["poisson"]["too_slow"] = True
    results = [result("a", 1.0, 1.0, poisson=2.0), room]
    lines = list(verdicts(results))
    assert "1 of 1 clean cases" in lines[0]
    assert lines[-1] == "Not counted, as no peer came to an end there: room."
    assert "| room | **1.000** | **1.000** | too slow | – |" in overview(results)
    assert "| room | Poisson | not done after 400 s |" in full_table(results)


def test_tables_show_the_lowest_and_what_failed():
    results = [result("a", 1.0, 1.5, poisson=2.0, front="crashed"), {"case": "b", "error": "MemoryError"}]
    assert best_peer(results[0]) == "poisson"
    lines = overview(results).splitlines()
    assert lines[0].split(" | ")[1:3] == ["VAD, double cover", "VAD, single layer"]
    assert lines[2] == "| a | **1.000** | 1.500 | 2.000 | failed | 0.50 |"
    rows = full_table(results).splitlines()[2:]
    assert rows[0] == "| a | VAD, double cover | – | 1.000 | 10.0 | 0.9000 | 2.00 | 3.00 | 7 |"
    assert rows[3] == "| a | advancing front | crashed | – | – | – | – | – | – |"
    assert len({line.count("|") for line in rows}) == 1
    without_cover = {key: value for key, value in results[0].items() if key != "mesh"}
    assert peer_tables([{"case": "b", "error": "MemoryError"}, without_cover]) == ""


def test_the_plot_sets_each_way_over_ours(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr("benchmarks.plots._save", lambda figure, path: made.append(figure))
    plot_cd(tmp_path, [result("a", 2.0, 1.0, poisson=1.0), result("b", 1.0, 3.0, poisson=4.0, front="crashed")])
    drawn = {line.get_label(): (list(line.get_xdata()), list(line.get_ydata())) for line in made[0].axes[0].lines}
    assert drawn["VAD, single layer"] == ([3.0, 0.5], [0, 1])  # b, the better one for us, comes first
    assert drawn["Poisson"] == ([4.0, 0.5], [0, 1])
    assert drawn["advancing front"] == ([], [])


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """800 points spread evenly on a sphere of radius .4, and a fine mesh of it."""
    from benchmarks.shapes.surface import from_implicit

    mesh = from_implicit(lambda x: (x**2).sum(axis=1) - 1, 1.2, 40).mesh
    height = 1 - (2 * np.arange(800) + 1) / 800
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(800)
    around = np.sqrt(1 - height**2)
    normals = np.stack([around * np.cos(turn), around * np.sin(turn), height], axis=1)
    path = tmp_path_factory.mktemp("cases") / "ball.npz"
    meta = json.dumps({"category": "watertight", "license": "CC0", "origin": "here"})
    np.savez(
        path,
        points=0.4 * normals,
        normals=normals,
        gt_v=mesh.vertices,
        gt_f=mesh.faces,
        nm_curve=np.empty((0, 3)),
        meta=meta,
    )
    return path


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_meshes_a_sphere(name, ball):
    pytest.importorskip(PEERS[name].module, exc_type=ImportError)
    found = measure_peers([name], ball, "uniform", 2)[name]
    assert found["cd"] < 5
    assert found["nc"] > 0.95
    assert found["seconds"] > 0
    ways = starts("watertight", 800, PEERS[name].normals, PEERS[name].octree)
    texts = [str(variant).strip("()[]") for variant in PEERS[name].variants if variant is not None] or [""]
    known = {"; ".join(filter(None, (str(start), text))) or None for start in ways for text in texts}
    assert found["variant"] in known


def test_peers_may_start_in_several_ways():
    assert starts("watertight", 1_000, False, False) == [Start()]
    assert [start.neighbours for start in starts("open", 10_000, True, False)] == [30, 12, 8]
    assert starts("open", 100_000, True, True) == [USUAL, Start(neighbours=30, depth=9)]
    assert [start.cleaning for start in starts("outliers", 50_000, True, False)] == [None, "strays dropped"]
    assert [str(start) for start in starts("noisy", 10_000, False, False)] == ["", "smoothed"]
    assert str(Start(neighbours=12, depth=9)) == "12 neighbours, depth 9"


def test_points_are_cleaned_before_peers_start():
    ball = np.random.default_rng(0).normal(size=(2_000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    pytest.importorskip("open3d", exc_type=ImportError)
    kept = readied(np.concatenate([ball, [[3.0, 0, 0]]]), Start("strays dropped"))
    assert 1_800 < len(kept) <= 2_000
    assert np.linalg.norm(kept, axis=1).max() < 1.1
    pytest.importorskip("CGAL")
    rough = ball * np.random.default_rng(1).normal(1, 0.02, (2_000, 1))
    smooth = readied(rough, Start("smoothed"))
    assert np.abs(np.linalg.norm(smooth, axis=1) - 1).mean() < 0.5 * np.abs(np.linalg.norm(rough, axis=1) - 1).mean()


def test_one_peers_failure_leaves_the_others(ball, monkeypatch):
    def broken(_, variant):
        raise RuntimeError("no")

    def fickle(points, variant):
        return broken(points, variant) if variant else _pyramid(points)

    whole = PEERS["front"]
    made = {"a": whole, "b": replace(whole, finish=broken), "c": replace(whole, finish=lambda *_: Mesh(*_EMPTY))}
    working = replace(whole, finish=lambda points, _: _pyramid(points))
    made |= {"a": working, "d": replace(whole, finish=fickle, variants=(1, 0))}
    monkeypatch.setattr("benchmarks.measure_peers.PEERS", made)
    found = measure_peers(["a", "b", "c", "d"], ball, "uniform", 1)
    assert found["a"]["cd"] > 1
    assert (found["d"]["cd"], found["d"]["variant"]) == (found["a"]["cd"], "0")
    assert found["b"] == {"error": "RuntimeError: no"}
    assert found["c"] == {"error": "ValueError: it made no triangle"}


_EMPTY = np.empty((0, 3)), np.empty((0, 3), np.int32)


def _pyramid(points):
    return Mesh(points[[0, 200, 400, 600]], np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1]], np.int32))


def test_peers_that_are_not_installed_are_left_out(monkeypatch):
    monkeypatch.setattr("benchmarks.peers.find_spec", lambda module: None)
    assert peer_libraries() == []
    assert ways().count("(not installed, left out)") == len(PEERS)


def test_an_open3d_that_does_not_load_is_said_at_once(monkeypatch):
    monkeypatch.setattr("benchmarks.peers.find_spec", lambda module: True)
    broken = [sys.executable, "-c", "raise ImportError('libthat is not there')"]
    run = subprocess.run
    monkeypatch.setattr("benchmarks.peers.subprocess.run", lambda _, **options: run(broken, **options))
    with pytest.raises(MissingDependency, match="load: ImportError: libthat is not there; install"):
        check_open3d.__wrapped__()


def timed(ours, others):
    times = {"ours": {"seconds": ours, "cpu": 2 * ours}, "poisson": {"seconds": others, "cpu": others}}
    return {**times, "load": 0.5, "ratio": {"seconds": ours / others, "cpu": 2 * ours / others}}


def test_times_alone_add_up():
    text = alone_section({"a": timed(1.0, 1.0), "b": timed(2.8, 2.0), "c": {"error": "broke"}})
    clock, cpu = (line for line in text.splitlines() if "median" in line and line.startswith("-"))
    assert clock == (
        "- **Met**: By the clock: 1.00 to 1.40, median 1.20, all cases together 1.27; at most 1.5 on 2 of 2 cases."
    )
    assert cpu == "- **Missed**: CPU: 2.00 to 2.80, median 2.40, all cases together 2.53; at most 1.5 on 0 of 2 cases."
    assert "| b | 2.80 | 5.60 | 2.00 | 2.00 | 1.40 | 2.80 | 0.5 |" in text
    assert alone_section({"c": {"error": "broke"}}) == ""


def test_both_ways_are_timed_alone(ball):
    pytest.importorskip("open3d", exc_type=ImportError)
    found = time_alone(ball, "uniform", Settings(resolution=32), 2)
    assert found["points"] == 800
    assert all(found[way][key] > 0 for way in ("ours", "poisson") for key in ("seconds", "cpu"))
    assert found["ratio"]["cpu"] == pytest.approx(found["ours"]["cpu"] / found["poisson"]["cpu"])
