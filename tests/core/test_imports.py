"""What the core may import, and where: it runs without Blender, without torch and on Windows."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "core").rglob("*.py"))
BLOCK = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {blocked}:
            raise ModuleNotFoundError("blocked: " + name, name=name)
sys.meta_path.insert(0, Blocked())
for name in {blocked}:
    sys.modules.pop(name, None)
"""
RECONSTRUCT = """
import json
import numpy as np
from core import MissingDependency, Settings, reconstruct
points = np.random.default_rng(0).normal(size=(60, 3))
points /= np.linalg.norm(points, axis=1, keepdims=True)
result = reconstruct(points, Settings(resolution=16, surface="none"))
print(json.dumps(result.report))
"""


def run(script, blocked=()):
    done = subprocess.run(
        [sys.executable, "-c", BLOCK.format(blocked=list(blocked)) + script], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_reconstructs_without_blender_torch_openvdb_and_scikit_image():
    report = json.loads(run(RECONSTRUCT, ["bpy", "torch", "openvdb", "skimage", "plyfile", "tqdm"]))
    assert report["counts"]["samples"] == 60
    assert report["peak_memory_mb"] > 10


def test_reconstructs_on_windows_which_has_no_resource_module():
    windows = "import sys, numpy, scipy.spatial, scipy.ndimage, scipy.sparse\nsys.platform = 'win32'\n"
    script = RECONSTRUCT.replace('surface="none"', 'surface="none", memory_limit=4096')  # no Windows call for the limit
    report = json.loads(run(windows + script, ["resource"]))
    assert report["peak_memory_mb"] is None


def test_importing_the_core_loads_numpy_and_scipy_and_nothing_else():
    script = """
import numpy, scipy, scipy.fft, scipy.ndimage, scipy.sparse.linalg, scipy.sparse.csgraph, scipy.spatial
before = set(sys.modules)
import core
new = {name.split(".")[0] for name in set(sys.modules) - before} - {"core", "numpy", "scipy"}
print(sorted(new - sys.stdlib_module_names))
"""
    assert run(script).strip() == "[]"


def imports(source):
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_module_names_blender_or_itself(source):
    """Inside a Blender extension the package is not called `core`, so its own imports have to be relative."""
    names = {name.split(".")[0] for name in imports(source)}
    assert names.isdisjoint({"bpy", "core", "vad_addon", "mathutils"})


@pytest.mark.parametrize("package", sorted({path.parent for path in SOURCES} - {ROOT / "core"}), ids=lambda p: p.name)
def test_a_package_says_what_each_of_its_modules_is_for(package):
    said = set(re.findall(r"\w+", ast.get_docstring(ast.parse((package / "__init__.py").read_text()))))
    modules = {source.stem for source in SOURCES if source.parent == package} - {"__init__"}
    assert not modules - said
