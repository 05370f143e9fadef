"""The command as a user runs it, on a small sphere, and what it says of bad input."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from skimage.measure import marching_cubes

from benchmarks.__main__ import main
from benchmarks.cases import load_case
from benchmarks.results import write_results

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A case: 400 points of a sphere of radius .4."""
    folder = tmp_path_factory.mktemp("cases")
    grid = np.stack(np.meshgrid(*3 * [np.linspace(-0.5, 0.5, 33)], indexing="ij"))
    vertices, faces, *_ = marching_cubes(np.linalg.norm(grid, axis=0), 0.4, spacing=(1 / 32,) * 3)
    normals = np.random.default_rng(0).normal(size=(400, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.savez(
        folder / "ball.npz",
        points=0.4 * normals,
        normals=normals,
        gt_v=vertices - 0.5,
        gt_f=faces,
        nm_curve=np.empty((0, 3)),
        meta=json.dumps({"category": "closed", "license": "CC0", "origin": "here"}),
    )
    return folder


@pytest.fixture(scope="module")
def saved(folder) -> tuple[Path, str]:
    """The file of a run of that case through the shell, and what was printed."""
    stem = folder / "out" / "run.1"
    command = [sys.executable, "-m", "benchmarks", folder, "--resolution", "32", "--set", "bridge=3.5", "--save", stem]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return stem.with_name("run.1.json"), done.stdout


def test_a_run_measures_a_sphere(saved):
    path, printed = saved
    assert "ball" in printed
    run = json.loads(path.read_text())
    assert (run["settings"]["resolution"], run["settings"]["bridge"]) == (32, 3.5)
    (ball,) = run["cases"]
    assert ball["mesh"]["cd"] < 5
    assert ball["mesh"]["euler_expected"] == 4
    assert ball["normals"]["nc"] > 0.99
    assert ball["field"]["near"] < 5
    assert ball["rims"] == {}
    assert sum(v for k, v in ball["seconds"].items() if k not in ("total", "cpu")) <= ball["seconds"]["total"]
    assert "| ball |" in path.with_name("run.1.md").read_text()


def test_the_page_is_made_of_the_runs(saved, tmp_path, monkeypatch):
    run = json.loads(saved[0].read_text())
    monkeypatch.setattr("benchmarks.results.DOCS", tmp_path)
    run["repeats"] = 3
    text = write_results({"uniform": run, "blue noise": run}, "mine").read_text()
    assert text.count("| ball |") == 1 + 2 * 7
    assert "bridge 3.5" in text
    assert "`python -m benchmarks FOLDER --results --page mine --repeats 3`" in text
    assert "Incomplete" not in text
    assert "## The same again" not in text
    assert "[blue noise](mine/blue_noise.json)" in text
    assert json.loads((tmp_path / "mine" / "blue_noise.json").read_text()) == run


def test_the_page_says_what_is_missing_and_what_came_out_twice(saved, tmp_path, monkeypatch):
    run = json.loads(saved[0].read_text())
    monkeypatch.setattr("benchmarks.results.DOCS", tmp_path)
    (ball,) = run["cases"]
    twice = {**ball, "case": "twice", "again": {"ours": 0.0, "poisson": 0.006}}
    run |= {"field": False, "jobs": 2, "cases": [ball, twice, {"case": "late", "error": "not measured"}]}
    text = write_results({"uniform": run}, "mine").read_text()
    assert "`python -m benchmarks FOLDER --results --page mine --surfaces --jobs 2`" in text
    assert "**Incomplete**: 1 of 3 cases with uniform samples are not measured yet (late)." in text
    assert "| VAD | 1 | 1 | 1 | 0.0% |" in text
    assert "| Poisson | 1 | 0 | 0 | 0.6% |" in text
    assert "- **Field**, on" not in text
    assert f"what measures it: {ball['code']}." in text


def test_the_fixture_is_a_case(folder):
    assert load_case(folder / "ball.npz").points.shape == (400, 3)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["{empty}"], "holds no .npz case"),
        (["{folder}", "--cases", "cube"], "no case is called cube; "),
        (["{folder}", "--resolution", "3"], "resolution is 3; it must be"),
        (["{folder}", "--set", "bridge"], "'bridge' sets nothing; write NAME=VALUE"),
        (["{folder}", "--set", "shine=1"], "'shine=1' sets nothing; write NAME=VALUE"),
        (["{folder}", "--compare", "{folder}/ball.npz"], "cannot be read as a saved run"),
        (["{folder}", "--results", "--cases", "ball"], "--results covers all cases"),
        (["{folder}", "--page", "mine"], "--page names the page that --results writes"),
        (["{folder}", "--repeats", "0"], "'0' is no number of repeats"),
        (["{folder}", "--blue-noise"], "no case has blue noise samples"),
        (["{folder}", "--shine"], "unrecognized arguments: --shine"),
        ([], "the following arguments are required: FOLDER"),
    ],
)
def test_bad_input_is_one_clear_line(arguments, said, folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("benchmarks.__main__.check_open3d", lambda: None)
    assert main([text.format(folder=folder, empty=tmp_path) for text in arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.startswith("error: ")
    assert error.count("\n") == 1
