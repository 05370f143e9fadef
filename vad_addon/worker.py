"""The worker process: one run, outside Blender, so that its window stays free and the run can be stopped at any moment.

Started by job.py with a folder that holds task.npz. Progress and failure go to stdout, one JSON object a line; the
results to outcome.npz and field.vdb in the folder.
"""

import json
import os
import shutil
import sys
import threading
import traceback
from pathlib import Path

from ..core.errors import VADError
from .outcome import Task, compute


def main(folder: Path) -> int:
    """Run the task in `folder` and return the exit status: 0 done, 1 failed."""
    _end_with_blender(folder)
    if hasattr(os, "nice"):
        os.nice(5)  # Blender's window goes first
    try:
        outcome = compute(Task.load(folder / "task.npz"), folder, _report)
        outcome.save(folder / "outcome.npz")
    except VADError as error:
        _tell(error=" ".join(str(error).split()))
    except Exception as error:  # noqa: BLE001  whatever it is, the user hears of it in one line
        traceback.print_exc()
        _tell(error=f"The reconstruction failed: {type(error).__name__}: {' '.join(str(error).split())}")
    else:
        return 0
    return 1


def _report(fraction, stage):
    _tell(fraction=fraction, stage=stage)


def _tell(**facts):
    sys.stdout.write(json.dumps(facts) + "\n")
    sys.stdout.flush()


def _end_with_blender(folder):
    """Blender holds the other end of stdin. When it is gone, however it ended, nobody waits for the results."""

    def watch():
        os.read(0, 1)
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
