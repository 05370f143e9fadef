"""A run in a process of its own: started, watched and stopped from Blender's side, which never waits for it."""

import contextlib
import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ..core.errors import VADError
from .outcome import OTHERWISE, Outcome, Task

EXTENSION = Path(__file__).resolve().parent.parent

# Makes the extension's folder a package, whatever its name and without touching its neighbours, and runs the worker.
_START = """
import importlib, pathlib, sys, types
package = types.ModuleType("vad_extension")
package.__path__ = [sys.argv[1]]
sys.modules["vad_extension"] = package
sys.exit(importlib.import_module("vad_extension.vad_addon.worker").main(pathlib.Path(sys.argv[2])))
"""

_NO_WINDOW = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # Windows would flash a console

_LEAST_SPACE = 1 << 20  # bytes

_running = None
_stopped = []  # jobs whose processes may not be dead yet


class Job:
    """One worker process and the folder through which it talks; :meth:`stop` ends both and may be called at any time,
    :meth:`cleared` says when both are gone.

    fraction, stage : progress as last heard
    """

    def __init__(self, task: Task, temporary: Path):
        """Start on `task`; what is exchanged goes to a new folder in `temporary`. Raises :class:`VADError`."""
        self.fraction, self.stage, self._error, self._process, self._output = 0.0, "starting", "", None, None
        self._started, self._folder = time.monotonic(), exchange_folder(temporary)
        try:
            task.save(self._folder / "task.npz")
            self._start()
        except OSError as error:
            self.stop()
            self.cleared(wait=True)
            raise _unusable(temporary, error) from error

    def _start(self):
        output, errors = self._folder / "progress", self._folder / "errors"
        with open(output, "wb") as stdout, open(errors, "wb") as stderr:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _START, str(EXTENSION), str(self._folder)],
                stdin=subprocess.PIPE,
                stdout=stdout,
                stderr=stderr,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(_library_path()), "PYTHONUTF8": "1"},
                creationflags=_NO_WINDOW,
            )
        self._output = open(output, "rb")  # noqa: SIM115  read bit by bit, closed by stop()

    def poll(self) -> bool:
        """Take in what the worker said since, but for what libraries print there; True once it has ended."""
        ended = self._process.poll() is not None
        for line in self._complete_lines():
            if not line.startswith(b"{"):
                continue
            facts = json.loads(line)
            self._error = facts.get("error", self._error)
            self.fraction, self.stage = facts.get("fraction", self.fraction), facts.get("stage", self.stage)
        return ended

    def outcome(self) -> Outcome:
        """What the run found. Raises :class:`VADError` with the reason, one line, where it failed."""
        if self._process.returncode == 0:
            return Outcome.load(self._folder / "outcome.npz")
        if shutil.disk_usage(self._folder).free < _LEAST_SPACE:  # then nothing else could be told
            raise _unusable(self._folder.parent, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
        raise VADError(self._error or self._sudden_end())

    def seconds_left(self) -> float | None:
        """An estimate, from the progress so far; None while there is too little of it."""
        elapsed = time.monotonic() - self._started
        return elapsed * (1 - self.fraction) / self.fraction if self.fraction > 0.02 and elapsed > 1 else None

    def stop(self) -> None:
        """Let the system end the process, at once and whatever it does. That takes a moment, longer on a busy machine,
        which nobody waits for here."""
        if self._process is not None:
            self._process.kill()
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        if self._output is not None:
            self._output.close()

    def cleared(self, wait: bool = False) -> bool:
        """Whether the process that was stopped is dead, or wait until it is; then remove what was exchanged with it:
        before, it might write more."""
        if self._process is not None:
            if wait:
                self._process.wait()
            if self._process.poll() is None:
                return False
        shutil.rmtree(self._folder, ignore_errors=True)
        return True

    def _complete_lines(self):
        while line := self._output.readline():
            if not line.endswith(b"\n"):
                self._output.seek(-len(line), os.SEEK_CUR)
                return
            yield line

    def _sudden_end(self):
        if self._process.returncode == -getattr(signal, "SIGKILL", 0):
            return "The system ended the run, probably for want of memory: lower the resolution, or give fewer points"
        lines = (self._folder / "errors").read_text("utf-8", "replace").split("\n")
        last = [line.strip() for line in lines if line.strip()][-1:]
        return f"The run ended unexpectedly with status {self._process.returncode}: {' '.join(last) or 'no message'}"


def exchange_folder(temporary: Path) -> Path:
    """A new folder in `temporary` for what a run writes before it is delivered. Raises :class:`VADError`."""
    try:
        return Path(tempfile.mkdtemp(prefix="vad-", dir=temporary))
    except OSError as error:
        raise _unusable(temporary, error) from error


def start(task: Task, temporary: Path) -> Job:
    """Start the one job there may be at a time; check :func:`running` first."""
    global _running
    _running = Job(task, temporary)
    return _running


def running() -> Job | None:
    """The job under way."""
    return _running


def stop() -> None:
    """Stop the job under way, if any; call :func:`clear` from time to time from then on."""
    global _running
    if _running is not None:
        _running.stop()
        _stopped.append(_running)
        _running = None


def clear(wait: bool = False) -> bool:
    """Remove what stopped jobs left, as far as their processes are dead, or wait until they are; True once all is
    gone."""
    _stopped[:] = [job for job in _stopped if not job.cleared(wait)]
    return not _stopped


def _library_path():
    """Where Blender's Python finds NumPy, SciPy and OpenVDB, without the folder of Blender's own scripts: its `bpy` is
    a facade for inside Blender and would hide the package of that name, which holds OpenVDB."""
    return [path for path in sys.path if path and not Path(path, "bpy", "__init__.py").exists()]


def _unusable(temporary, error):
    return VADError(f"The run cannot go on: {error.strerror or error} ({temporary}); free space there, or {OTHERWISE}")
