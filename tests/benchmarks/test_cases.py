"""What counts as a case, and how folders that hold none are refused."""

import json

import numpy as np
import pytest

from benchmarks.cases import find_cases, has_sampling, load_case
from core import InputError

ARRAYS = {
    "points": np.eye(3, dtype=np.float32),
    "normals": np.eye(3, dtype=np.float32),
    "gt_v": np.eye(3, dtype=np.float32),
    "gt_f": np.array([[0, 1, 2]]),
    "nm_curve": np.empty((0, 3), np.float32),
    "meta": json.dumps({"category": "open"}),
}


def test_a_case_is_read_as_written(tmp_path):
    np.savez(tmp_path / "a.npz", **ARRAYS, points_pd=2 * np.eye(3), normals_pd=-np.eye(3))
    case = load_case(tmp_path / "a.npz")
    assert (case.name, case.meta) == ("a", {"category": "open"})
    np.testing.assert_array_equal(case.points, np.eye(3))
    np.testing.assert_array_equal(case.truth.faces, [[0, 1, 2]])
    blue = load_case(tmp_path / "a.npz", "blue noise")
    np.testing.assert_array_equal(blue.points, 2 * np.eye(3))
    np.testing.assert_array_equal(blue.normals, -np.eye(3))


def test_cases_are_found_in_the_order_asked_for(tmp_path):
    for name in "bca":
        np.savez(tmp_path / f"{name}.npz", **ARRAYS)
    assert [path.stem for path in find_cases(tmp_path)] == ["a", "b", "c"]
    assert [path.stem for path in find_cases(tmp_path, ["c", "a"])] == ["c", "a"]
    assert has_sampling(tmp_path / "a.npz", "uniform")
    assert not has_sampling(tmp_path / "a.npz", "blue noise")


def test_what_is_no_case_is_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"holds no \.npz case"):
        find_cases(tmp_path)
    np.savez(tmp_path / "a.npz", **{name: array for name, array in ARRAYS.items() if name != "gt_v"})
    with pytest.raises(InputError, match=r"no case is called x, y; .* holds a$"):
        find_cases(tmp_path, ["a", "x", "y"])
    with pytest.raises(InputError, match="lacks gt_v; a uniform case"):
        load_case(tmp_path / "a.npz")
    with pytest.raises(InputError, match="lacks points_pd, normals_pd"):
        load_case(tmp_path / "a.npz", "blue noise")
    (tmp_path / "b.npz").write_text("no archive")
    with pytest.raises(InputError, match=r"b\.npz cannot be read"):
        load_case(tmp_path / "b.npz")


def test_pickled_objects_are_not_loaded(tmp_path):
    np.savez(tmp_path / "a.npz", **(ARRAYS | {"meta": np.array([{}], object)}))
    with pytest.raises(InputError, match=r"a\.npz cannot be read"):
        load_case(tmp_path / "a.npz")
