"""Work in other processes: results, errors, crashes and time limits come back as they should."""

import os
import time

import pytest

from benchmarks.processes import Failed, one_thread_each, run_fresh, run_warm


def test_results_and_errors_come_back():
    assert run_fresh(divmod, 7, 2) == (3, 1)
    with pytest.raises(Failed, match="ZeroDivisionError: "):
        run_fresh(divmod, 7, 0)


def test_a_crash_and_an_endless_run_end():
    with pytest.raises(Failed, match="crashed with exit code 3"):
        run_warm(os._exit, 3, limit=60)
    with pytest.raises(Failed, match="not done after 1 s"):
        run_warm(time.sleep, 60, limit=1)


def test_threads_are_one_meanwhile_and_as_before_after(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    with one_thread_each():
        assert run_fresh(os.getenv, "OMP_NUM_THREADS") == run_fresh(os.getenv, "OPENBLAS_NUM_THREADS") == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "OPENBLAS_NUM_THREADS" not in os.environ
