"""Parts of a long run kept as they are measured, so that one that was interrupted goes on where it ended."""

import json
from collections.abc import Callable
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from core.io.atomic import writable_folder
from core.io.report import write_report

_ROOT = Path(__file__).resolve().parent.parent
_MEASURES = ("cases", "metrics", "geometry", "processes", "peers", "starts")
OURS = ("core/**/*.py", *(f"benchmarks/{name}.py" for name in (*_MEASURES, "run", "field_metrics")))
ALONE = (*OURS, "benchmarks/alone.py")
PEERS = tuple(f"benchmarks/{name}.py" for name in (*_MEASURES, "measure_peers"))
_OURS = "numpy", "scipy", "libigl", "scikit-image", "bpy"
_LIBRARIES = {OURS: _OURS, ALONE: (*_OURS, "open3d"), PEERS: ("numpy", "libigl", "open3d", "cgal")}


def code_version(sources: tuple[str, ...]) -> str:
    """Eight digits that change with the source files and with the versions of the libraries they use."""
    digest = sha256("".join(map(_version, _LIBRARIES[sources])).encode())
    for pattern in sources:
        for path in sorted(_ROOT.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:8]


def _version(library):
    try:
        return version(library)
    except PackageNotFoundError:
        return "none"


def once(file: Path, sources: tuple[str, ...], made_of: str, measure: Callable[[], dict]) -> dict:
    """What `measure` returns, or what it returned before, where `file` keeps that from the same code and `made_of`, a
    text that says all else that it depends on. Nothing is kept of a call that raises."""
    stamp = {"code": code_version(sources), "made_of": made_of}
    if file.exists():
        before = json.loads(file.read_text("utf-8"))
        if before["stamp"] == stamp:
            return before["result"]
    result = measure()
    writable_folder(file.parent)
    write_report(file, {"stamp": stamp, "result": result})
    return json.loads(file.read_text("utf-8"))["result"]
