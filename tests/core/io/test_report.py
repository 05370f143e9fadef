import json
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from core.io.report import report_json, report_of, write_report

leaves = st.one_of(st.none(), st.booleans(), st.integers(), st.text(), st.floats())
reports = st.recursive(leaves, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8)


def strict(text):
    def refuse(token):
        raise AssertionError(f"{token} is not JSON")

    return json.loads(text, parse_constant=refuse)


@settings(deadline=None)
@given(st.dictionaries(st.text(), reports))
def test_any_report_is_strict_json(report):
    assert set(strict(report_json(report))) == set(report)


def test_numpy_values_paths_and_infinities(tmp_path):
    report = {
        "count": np.int64(3),
        "seconds": np.float32(0.5),
        "flag": np.bool_(True),
        "box": np.array([[0.0, np.nan], [1.0, np.inf]]),
        "file": Path("a") / "b.ply",
        "band": -np.inf,
        "limits": (1, 2),
    }
    write_report(tmp_path / "report.json", report)
    assert strict((tmp_path / "report.json").read_text()) == {
        "count": 3,
        "seconds": 0.5,
        "flag": True,
        "box": [[0.0, None], [1.0, None]],
        "file": str(Path("a") / "b.ply"),
        "band": None,
        "limits": [1, 2],
    }


def test_the_scan_of_a_report_is_read_back(tmp_path):
    path = tmp_path / "report.json"
    assert report_of(path) == {}
    run = {"settings": {}, "counts": {}, "seconds": {}}
    write_report(path, run | {"scan": tmp_path / "b.ply"})
    assert report_of(path)["scan"] == str(tmp_path / "b.ply")
    others = run | {"scan": 3}, {"scan": "b.ply", "scanner": "a user's own"}
    for other in (*map(json.dumps, others), "[]", "{", "\udcff"):
        path.write_bytes(other.encode("utf-8", "surrogateescape"))
        assert report_of(path) == {}
