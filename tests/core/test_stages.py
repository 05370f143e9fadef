"""Every stage alone, as the README shows it, gives what a whole run gives."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import core
from core import Settings, reconstruct
from core.io.points import read_points

ROOT = Path(__file__).resolve().parents[2]


def shown(first):
    """The README's Python example that starts with this line."""
    (script,) = re.findall(
        rf"```python\n({re.escape(first)}.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL
    )
    return script


def test_stages_in_a_row_are_the_whole_run(monkeypatch):
    monkeypatch.chdir(ROOT)
    found = {}
    exec(shown("from core import denoise"), found)
    points = read_points("tests/data/bust.ply")
    whole = reconstruct(points, Settings(resolution=64, surface="both"))
    assert len(found["points"]) == len(whole.points)
    agreement = np.abs(np.einsum("ni,ni->n", found["normals"], whole.normals))
    assert np.median(agreement) > 0.9999
    assert found["values"].shape == whole.field.values.shape
    assert np.abs(found["values"] - whole.field.values).mean() < 0.02 * whole.field.spacing
    for mesh, expected in ((found["cover"], whole.surface), (found["sheet"], whole.sheet)):
        assert abs(len(mesh.faces) - len(expected.faces)) < 0.02 * len(expected.faces)


def test_all_public_names_are_there_and_no_others():
    for name in core.__all__:
        assert getattr(core, name).__name__ == name
    assert not hasattr(core, "no_such_name")


def test_settings_and_errors_alone_need_no_scipy():
    code = "import sys, core; core.Settings, core.VADError; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT).returncode == 0
