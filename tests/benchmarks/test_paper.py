"""The published tables are complete, and our runs land beside the shapes they belong to."""

import json

import pytest

from benchmarks.paper import write_page
from benchmarks.published import CATEGORIES, NON_WATERTIGHT, NORMALS, WATERTIGHT
from core import InputError


def measured(case, category, cd, nc):
    return {
        "case": case,
        "category": category,
        "points": 5_000,
        "mesh": {"cd": cd, "hd": 12.0, "f005": 0.99, "f010": 1.0},
        "normals": {"nc": nc},
    }


def test_every_method_has_a_figure_for_every_shape():
    for table in (NORMALS, WATERTIGHT, NON_WATERTIGHT):
        assert {len(figures) for figures in table.values()} == {len(table["shapes"])}
        assert "VAD" in table
    assert all(len(vad) == len(other) == 4 for vad, other in CATEGORIES.values())


def test_runs_stand_beside_what_they_are_like(tmp_path):
    runs = {
        ("results", "uniform"): [measured("cloth_10k", "open", 0.5, 0.9), {"case": "spot_10k", "error": "broke"}],
        ("bench", "uniform"): [measured("cloth_10k", "open", 0.25, 0.8), measured("knot_1k", "watertight", 0.75, 0.7)],
        ("bench", "blue_noise"): [measured("cloth_10k", "open", 0.125, 0.95)],
    }
    for (page, sampling), cases in runs.items():
        (tmp_path / page).mkdir(exist_ok=True)
        (tmp_path / page / f"{sampling}.json").write_text(json.dumps({"cases": cases}))
    lines = write_page(tmp_path).read_text().splitlines()
    cloth = "| Cloth (10k) | 0.172 / 10.8 | 0.162 / 8.8 |"
    assert f"{cloth} cloth_10k, for development | 0.500 / 12.0 | – |" in lines
    assert "|  |  |  | cloth_10k, made by script | 0.250 / 12.0 | 0.125 / 12.0 |" in lines
    assert "| Knot (1k) | 0.468 / 8.0 | 0.812 / 7.4 | knot_1k, made by script | 0.750 / 12.0 | – |" in lines
    assert "| Bears | 0.9909 | 0.9873 | – | – | – |" in lines
    clothes = next(line for line in lines if line.startswith("| clothes"))
    assert "| 0.375 |" in clothes  # mean of both
    assert clothes.endswith("| for development: cloth_10k; made by script: cloth_10k |")


def test_without_runs_there_is_no_page(tmp_path):
    with pytest.raises(InputError, match="holds no results; make them"):
        write_page(tmp_path)
