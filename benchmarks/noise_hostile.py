"""Bad input, really tried: arrays and files that are no clean scan, and what each of them got."""

import io
import pickle
import struct
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from core import Settings, VADError, reconstruct
from core.io.points import read_points

RESOLUTION = 32
LONGEST = 20.0  # seconds; anything longer counts as a hang

_SPHERE_POINTS = 1000


def _ball(count: int = _SPHERE_POINTS, seed: int = 0) -> np.ndarray:
    x = np.random.default_rng(seed).normal(size=(count, 3))
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def _uv_sphere(rings: int, segments: int) -> np.ndarray:
    up, around = np.meshgrid(np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, segments))
    return np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], -1).reshape(-1, 3)


def _grid(*counts: int) -> np.ndarray:
    return np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1).reshape(-1, len(counts)).astype(float)


def _with(rows) -> np.ndarray:
    return np.vstack([_ball(), rows])


BALL = "1,000 points of a sphere"
POINTS: dict[str, Callable[[], object]] = {
    BALL: _ball,
    "the same, half of them twice": lambda: _with(_ball()[:500]),
    "the same, times 1e-9": lambda: 1e-9 * _ball(),
    "the same, times 1e9": lambda: 1e9 * _ball(),
    "the same, moved by 1e6": lambda: _ball() + 1e6,
    "with 3 rows of NaN and 2 of infinity": lambda: _with([[np.nan] * 3] * 3 + [[np.inf, 0, 0], [0, -np.inf, 0]]),
    "with one point at 1e6": lambda: _with([[1e6, 0, 0]]),
    "with a copy a thousand radii away": lambda: _with(_ball() + 1e3),
    "as float16": lambda: _ball().astype(np.float16),
    "as integers from -50 to 50": lambda: np.rint(50 * _ball()).astype(np.int32),
    "every other column, backwards, big-endian": lambda: np.repeat(_ball(), 2, axis=1)[::-1, ::2].astype(">f8"),
    "as nested lists": lambda: _ball().tolist(),
    "UV sphere, 7,200 points": lambda: _uv_sphere(60, 120),
    "solid grid of 14³": lambda: _grid(14, 14, 14),
    "flat grid of 60²": lambda: np.pad(_grid(60, 60), ((0, 0), (0, 1))),
    "nothing but noise, 1,000 points": lambda: np.random.default_rng(0).normal(size=(1000, 3)),
    "4 points": lambda: np.vstack([np.eye(3), np.zeros(3)]),
    "3 points": lambda: np.eye(3),
    "no points": lambda: np.empty((0, 3)),
    "500 points on a line": lambda: np.linspace(0, 1, 500)[:, None] * [1.0, 2.0, 3.0],
    "1,000,000 equal points": lambda: np.ones((1_000_000, 3)),
    "1,000,000 points, 4 of them different": lambda: np.tile(np.vstack([np.eye(3), np.zeros(3)]), (250_000, 1)),
    "only NaN": lambda: np.full((100, 3), np.nan),
    "two columns": lambda: _ball()[:, :2],
    "complex numbers": lambda: _ball() + 1j,
    "text": lambda: [["a", "b", "c"]] * 10,
    "rows of unequal length": lambda: [[0, 0, 0], [1, 2]],
    "spanning 1e200": lambda: 1e200 * _ball(),
}


def _ply(count: int, body: bytes) -> bytes:
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
    return (head + "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n").encode() + body


def _npy(array) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def _bomb() -> bytes:
    """An archive of a few MiB that unpacks to 2.25 GiB of zeros."""
    stream, block, blocks = io.BytesIO(), bytes(3 * 2**23), 96
    with (
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("points.npy", "w", force_zip64=True) as entry,
    ):
        shape = (len(block) * blocks // 24, 3)
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False, "shape": shape})
        for _ in range(blocks):
            entry.write(block)
    return stream.getvalue()


_FLOATS = _ball().astype("<f4").tobytes()
FILES: dict[str, tuple[str, Callable[[], bytes]]] = {
    ".ply, whole": ("ply", lambda: _ply(_SPHERE_POINTS, _FLOATS)),
    ".ply cut off in the middle": ("ply", lambda: _ply(_SPHERE_POINTS, _FLOATS[: len(_FLOATS) // 2])),
    ".ply whose header claims 10 GB": ("ply", lambda: _ply(900_000_000, _FLOATS)),
    ".ply that is binary junk": ("ply", lambda: np.random.default_rng(0).bytes(5000)),
    ".xyz that is binary junk": ("xyz", lambda: np.random.default_rng(0).bytes(5000)),
    ".csv of words": ("csv", lambda: b"name,age,town\nann,3,rome\nbob,4,oslo\n"),
    ".txt with a word in line 3": ("txt", lambda: b"0 0 0\n1 0 0\n0 one 0\n0 0 1\n"),
    ".npy of pickled objects": ("npy", lambda: _npy(np.array([{"a": 1}] * 4, object))),
    ".npy that is a pickle": ("npy", lambda: pickle.dumps(_ball())),
    ".npz, a zip bomb of 2.25 GiB": ("npz", _bomb),
    ".npz with a broken directory": ("npz", lambda: b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 1, 1, 99, 99, 0)),
    ".obj without vertices": ("obj", lambda: b"o thing\nf 1 2 3\n"),
    "empty .xyz": ("xyz", lambda: b""),
    ".las": ("las", lambda: b"LASF" + bytes(300)),
}


def tried() -> list[dict]:
    """`given`, `got` (one line), `outcome` ("done", "refused", "crashed", "not finite" or "hung") and `seconds` for
    every array and file."""
    rows = [_row(name, lambda make=make: make()) for name, make in POINTS.items()]
    with tempfile.TemporaryDirectory() as folder:
        for name, (kind, make) in FILES.items():
            path = Path(folder) / f"scan.{kind}"
            path.write_bytes(make())
            rows.append(_row(name, lambda path=path: read_points(path), folder))
    return rows


def fuzzed(seed: int = 0) -> dict:
    """Every base cloud with every sort of dirt, in turn as another type of array and at another scale: how many of each
    outcome, and the longest seconds."""
    bases = {
        "sphere": _ball(300),
        "UV sphere": _uv_sphere(12, 24),
        "solid grid": _grid(6, 6, 6),
        "flat": _ball(200) * [1, 1, 0],
        "noise": np.random.default_rng(seed).normal(size=(200, 3)),
        "close sheets": np.vstack([_ball(150) * [1, 1, 0], _ball(150, 1) * [1, 1, 0] + [0, 0, 0.05]]),
    }
    forms = (np.asarray, np.float32, lambda x: x[::-1], lambda x: x.astype(">f8"), np.asfortranarray)
    rows = []
    for base in bases.values():
        for dirty in _dirty(base, np.random.default_rng(seed)):
            turn = len(rows)
            points = forms[turn % len(forms)](dirty * 10.0 ** (turn % 19 - 9))
            rows.append(_row("", lambda points=points: points, resolution=16))
    outcomes = [row["outcome"] for row in rows]
    counts = {name: outcomes.count(name) for name in ("done", "refused", "crashed", "not finite", "hung")}
    return {"runs": len(rows), **counts, "seconds": max(row["seconds"] for row in rows)}


def _dirty(points, rng) -> Iterator[np.ndarray]:
    yield np.vstack([points, points[: len(points) // 2]])
    yield np.vstack([points, points * (1 + 1e-15)])
    yield np.vstack([points, np.full((3, 3), np.nan)])
    yield np.vstack([[[np.inf, 0, 0]], points])
    yield np.vstack([points, [[1e6, 0, 0]]])
    yield np.vstack([points, points + 1e3])
    yield np.vstack([points, 1e-3 * points + 50])
    yield np.vstack([points, rng.uniform(-2, 2, (len(points) // 10, 3))])
    yield points + rng.normal(size=points.shape) * 0.02
    yield np.round(points, 1)


def _row(name, points, folder=None, resolution=RESOLUTION):
    start = time.perf_counter()
    try:
        given = points()
        result = reconstruct(given, Settings(resolution=resolution))
        outcome, got = _outcome(result)
    except VADError as error:
        outcome, got = "refused", str(error).replace(f"{folder}/", "")
    except Exception as error:  # noqa: BLE001 - whatever it is, it is what the table is about
        outcome, got = "crashed", f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - start
    return {"given": name, "got": got, "outcome": "hung" if seconds > LONGEST else outcome, "seconds": seconds}


def _outcome(result):
    found = (result.points, result.normals, result.confidence, result.field.values, result.surface.vertices)
    if not all(np.isfinite(array).all() for array in found):
        return "not finite", "NaN or infinities in the result"
    notes = [f"{len(result.points):,} samples, {len(result.surface.faces):,} faces", *result.report["warnings"]]
    return "done", "; ".join(notes)
