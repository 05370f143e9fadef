"""Runs that are stopped, killed or given another number of threads."""

import hashlib
import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from core import Cancelled, Settings, reconstruct
from core.io.openvdb_module import load_openvdb
from tests import shapes

ROOT = Path(__file__).parents[2]
DIGEST = """
import hashlib, sys, numpy as np
from core import Settings, reconstruct
settings = Settings(resolution=40, surface="both", solver=sys.argv[2], integration=sys.argv[3])
result = reconstruct(np.load(sys.argv[1]), settings)
arrays = result.points, result.normals, result.confidence, result.field.values
arrays += result.surface.vertices, result.surface.faces, result.sheet.vertices, result.sheet.faces
print(hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest())
"""


def noisy_sphere(n, deviation=0.02):
    return shapes.scattered_sphere(n) + np.random.default_rng(7).normal(size=(n, 3)) * deviation


@pytest.mark.parametrize(
    ("deviation", "solver", "integration"),
    [(0.0, "reflection", "transport"), (0.03, "reflection", "poisson"), (0.0, "energy", "transport")],
)
def test_the_number_of_threads_changes_no_byte(tmp_path, deviation, solver, integration):
    np.save(tmp_path / "points.npy", noisy_sphere(3000, deviation))
    digests = set()
    for threads in ("1", "2", "5"):
        limits = dict.fromkeys(
            ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"), threads
        )
        done = subprocess.run(
            [sys.executable, "-c", DIGEST, tmp_path / "points.npy", solver, integration],
            cwd=ROOT, env=os.environ | limits, capture_output=True, text=True, check=True,
        )  # fmt: skip
        digests.add(done.stdout)
    assert len(digests) == 1


def test_a_stopped_run_leaves_no_thread_and_no_process():
    before = threading.active_count()
    with pytest.raises(Cancelled):
        reconstruct(noisy_sphere(2000), Settings(resolution=48), progress=lambda fraction, text: fraction < 0.6)
    assert threading.active_count() == before
    assert not multiprocessing.active_children()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no kill -9 here")
def test_kill_at_any_moment_leaves_earlier_output_whole(tmp_path):
    scan, out = tmp_path / "ball.npy", tmp_path / "out"
    np.save(scan, shapes.sphere(800))
    command = [sys.executable, "-m", "core", "reconstruct", str(scan), "-o", str(out), "--resolution", "32"]
    start = time.perf_counter()
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    length = time.perf_counter() - start
    whole = digests(out)
    chance = random.Random(0)
    for _ in range(8):
        run = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(chance.uniform(0.5, 1.0) * length)
        run.send_signal(signal.SIGKILL)
        run.wait()
        assert digests(out) == whole
        assert json.loads((out / "ball.json").read_text())["counts"]["samples"] == 800


def digests(folder):
    """What the meshes, points and voxels of a run come to; VDB files carry a random name, so their bytes differ."""
    found = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("ball*.ply"))}
    grids, _ = load_openvdb().readAll(str(folder / "ball.vdb"))
    return found | {grid.name: (grid.activeVoxelCount(), grid.evalMinMax()) for grid in grids}
