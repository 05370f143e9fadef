"""Work in other processes: results, errors, crashes and time limits come back as they should."""

import os
import subprocess
import sys
import time
from pathlib import Path

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


@pytest.mark.skipif(sys.platform != "linux", reason="asks for the state of a process in /proc")
@pytest.mark.parametrize("how", ["run_fresh(os.system, {!r})", "run_warm(os.system, {!r}, limit=60)"])
def test_none_is_left_at_work_when_the_run_is_killed(how, tmp_path):
    """Its number is written by a shell that it runs."""
    file = tmp_path / "number"
    shell = f"echo $PPID > {file}.new; mv {file}.new {file}; sleep 60"
    code = "import os; from benchmarks.processes import run_fresh, run_warm; " + how.format(shell)
    run = subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[2])
    _wait_for(file.exists)
    number = int(file.read_text())
    assert _works(number)
    run.kill()
    run.wait()
    _wait_for(lambda: not _works(number))


def _works(number):
    """Whether a process is there that is no mere entry in the system's table."""
    try:
        status = Path(f"/proc/{number}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):  # the latter where it ends between opening and reading
        return False
    return status.rsplit(")", 1)[1].split()[0] != "Z"


def _wait_for(met):
    until = time.monotonic() + 20
    while not met():
        assert time.monotonic() < until
        time.sleep(0.05)


def test_threads_are_one_meanwhile_and_as_before_after(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    with one_thread_each():
        assert run_fresh(os.getenv, "OMP_NUM_THREADS") == run_fresh(os.getenv, "OPENBLAS_NUM_THREADS") == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "OPENBLAS_NUM_THREADS" not in os.environ
