"""Many cases: in order, some at a time, on from where they ended, no further than time allows."""

import time

import numpy as np
import pytest

from benchmarks import run
from benchmarks.processes import Failed, TooSlow
from core import Settings


@pytest.fixture
def paths(tmp_path):
    """Three cases of 10,000, 10 and 20 points that hold these alone."""
    made = []
    for name, points in (("a", 10_000), ("b", 10), ("c", 20)):
        made.append(tmp_path / f"{name}.npz")
        np.savez(made[-1], points=np.zeros((points, 3)))
    return made


@pytest.fixture
def calls(monkeypatch):
    """Names of the functions that were run in processes of their own, with their cases; all of case c fail."""
    made = []

    def run_fresh(function, path, *_):
        made.append((function.__name__, path.stem))
        if path.stem == "c":
            raise Failed("broke")
        return {"case": path.stem, "points": 10, "mesh": {"cd": 1.0}, "seconds": {"total": 1.0, "cpu": 1.0}}

    monkeypatch.setattr(run, "run_fresh", run_fresh)
    return made


def test_results_come_in_order_and_failures_say_why(paths, calls):
    for jobs in (1, 3):
        results = list(run.run_cases(paths, "uniform", run.Plan(Settings(), jobs=jobs)))
        assert [result["case"] for result in results] == ["a", "b", "c"]
        assert results[2] == {"case": "c", "error": "broke"}
    assert run.missing(results) == []


def test_a_later_run_goes_on_where_one_ended(paths, calls, tmp_path):
    plan = run.Plan(Settings(), keep=tmp_path / "kept")
    before = list(run.run_cases(paths, "uniform", plan))
    assert len(calls) == 3
    over = run.Plan(Settings(), keep=plan.keep, until=time.monotonic() - 1)
    after = list(run.run_cases(paths, "uniform", over))
    assert after[:2] == before[:2]
    assert run.missing(after) == ["c"]
    assert list(run.run_cases(paths, "uniform", plan)) == before
    assert calls[3:] == [("run_case", "c")]
    list(run.run_cases(paths[:1], "uniform", run.Plan(Settings(bridge=5), keep=plan.keep)))
    assert calls[4:] == [("run_case", "a")]


def test_small_cases_are_measured_twice_where_times_are_repeated(paths, calls):
    result = next(run.run_cases(paths, "uniform", run.Plan(Settings(), repeats=3)))
    assert result["again"] == {"ours": 0.0}
    assert calls[:2] == [("run_case", "a")] * 2


def test_cases_of_ten_thousand_points_are_timed_alone(paths, calls):
    plan = run.Plan(Settings(), repeats=3)
    assert [name for name, _ in run.time_cases(paths, "uniform", plan)] == ["a"]
    assert calls == [("time_alone", "a")]


@pytest.mark.parametrize("error", [TooSlow, Failed])
def test_what_starts_as_a_slow_peer_does_is_not_waited_for(error, paths, calls, monkeypatch):
    def run_warm(_, names, *__, limit):
        begun.append(names)
        if names[0] in ("poisson", "alpha"):
            raise error("no")
        return {name: {"error": "made up"} for name in names}

    begun = []
    monkeypatch.setattr(run, "run_warm", run_warm)
    monkeypatch.setattr("benchmarks.peers.find_spec", lambda module: True)
    found = next(run.run_cases(paths[:1], "uniform", run.Plan(Settings(), peers=True)))["peers"]
    slow = error is TooSlow
    failed = {name for name in found if found[name] == {"error": "no", "too_slow": slow}}
    assert failed == {"poisson", "trimmed", "alpha"}
    skipped = {"error": "not begun: orientation takes too long", "too_slow": True}
    assert found["pivoting"] == (skipped if slow else {"error": "made up"})
    assert ["pivoting"] not in begun if error is TooSlow else ["pivoting"] in begun


def test_a_peer_that_was_too_slow_is_not_tried_again_and_one_that_failed_is(paths, calls, monkeypatch, tmp_path):
    def run_warm(_, names, *__, limit):
        begun.append(names)
        raise (TooSlow if names[0] == "alpha" else Failed)("no")

    begun, plan = [], run.Plan(Settings(), peers=True, keep=tmp_path / "kept")
    monkeypatch.setattr(run, "run_warm", run_warm)
    monkeypatch.setattr("benchmarks.peers.find_spec", lambda module: True)
    before = next(run.run_cases(paths[:1], "uniform", plan))
    tried = begun.copy()
    assert ["alpha"] in tried
    begun.clear()
    assert next(run.run_cases(paths[:1], "uniform", plan)) == before
    assert begun == [names for names in tried if names != ["alpha"]]
