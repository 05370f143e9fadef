"""Reports as strict JSON."""

import hashlib
import json
import math
import os
from pathlib import Path

import numpy as np

from .atomic import atomic_path

_OF_A_RUN = {"settings", "counts", "seconds"}  # what every report of one holds


def report_json(report: dict) -> str:
    """`report` as strict JSON text: NumPy scalars and arrays become numbers and lists, NaN and infinities null."""
    return json.dumps(_plain(report), indent=2, allow_nan=False)


def write_report(path: str | os.PathLike, report: dict) -> None:
    """Write :func:`report_json` of `report` as the file `path`."""
    with atomic_path(path) as temporary:
        temporary.write_text(report_json(report) + "\n", encoding="utf-8")


def report_of(path: str | os.PathLike) -> dict:
    """The report of a scan that was written as the file `path`; empty where there is no such file, or another."""
    path = Path(path)
    try:
        report = json.loads(path.read_text("utf-8")) if path.is_file() else {}  # a pipe would be waited for
    except (OSError, ValueError):
        return {}
    sound = isinstance(report, dict) and report.keys() >= _OF_A_RUN and isinstance(report.get("scan"), str)
    return report if sound else {}


def digest_of(path: str | os.PathLike) -> str:
    """SHA-256 of the file `path`, by which the report of a scan knows it where it was moved."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _plain(value):
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
