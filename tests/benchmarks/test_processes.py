"""Work in other processes: results, errors, crashes and time limits come back as they should."""

import os
import time

import pytest

from benchmarks.processes import Failed, run_fresh, run_warm


def test_results_and_errors_come_back():
    assert run_fresh(divmod, 7, 2) == (3, 1)
    with pytest.raises(Failed, match="ZeroDivisionError: "):
        run_fresh(divmod, 7, 0)


def test_a_crash_and_an_endless_run_end():
    with pytest.raises(Failed, match="crashed with exit code 3"):
        run_warm(os._exit, 3, limit=60)
    with pytest.raises(Failed, match="not done after 1 s"):
        run_warm(time.sleep, 60, limit=1)
