"""Cases made by script: complete, repeatable, spoiled as their recipe says."""

import numpy as np
import pytest

from benchmarks.cases import SPOILED, has_sampling, load_case
from benchmarks.catalogue import CASES, make_case
from benchmarks.geometry import closest_points
from benchmarks.make_cases import main


def test_every_kind_of_input_has_a_case():
    categories = {recipe.category for recipe in CASES.values()}
    assert categories >= {
        "watertight",
        "open",
        "non-manifold",
        "non-orientable",
        "high genus",
        "indoor scene",
        "sparse",
    }
    assert categories >= SPOILED
    assert {recipe.count for recipe in CASES.values()} >= {100, 1_000, 10_000, 100_000, 150_000, 200_000}


def test_a_case_is_complete_and_repeatable(tmp_path):
    first, second = (load_case(make_case(tmp_path / name, "paperplane_1k")) for name in _folders(tmp_path))
    assert first.meta["category"] == "non-manifold"
    assert len(first.points) == 1_000
    assert len(first.nm_curve)
    np.testing.assert_array_equal(first.points, second.points)
    assert closest_points(first.points, first.truth)[0].max() < 1e-6
    blue = load_case(tmp_path / "a" / "paperplane_1k.npz", "blue noise")
    assert closest_points(blue.points, blue.truth)[0].max() < 1e-6


def _folders(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
        yield name


def test_noise_and_strays_are_as_the_recipe_says(tmp_path, monkeypatch):
    cube = CASES["cube_5k"]
    spoiled = {
        "noisy": cube.__class__("noisy", cube.surface, 2_000, noise=1.0),
        "strewn": cube.__class__("outliers", cube.surface, 2_000, strays=0.1),
    }
    monkeypatch.setattr("benchmarks.catalogue.CASES", spoiled)
    noisy, strewn = (load_case(make_case(tmp_path, name)) for name in spoiled)
    off = closest_points(noisy.points, noisy.truth)[0]
    assert np.sqrt((off**2).mean()) == pytest.approx(0.008, rel=0.1)
    assert len(strewn.points) == 2_200
    assert (closest_points(strewn.points, strewn.truth)[0] < 1e-6).sum() == pytest.approx(2_000, abs=5)
    assert not has_sampling(tmp_path / "noisy.npz", "blue noise")


def test_the_command_makes_what_is_missing(tmp_path, capsys):
    arguments = [str(tmp_path / "cases"), "--cases", "tjunction_5k"]
    assert main(arguments) == 0
    assert capsys.readouterr().out.startswith("made ")
    assert main(arguments) == 0
    assert capsys.readouterr().out == "tjunction_5k is there\n"
    assert main([str(tmp_path), "--cases", "teapot"]) == 2
    assert "no case is called teapot; " in capsys.readouterr().err
