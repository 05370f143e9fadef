"""The zip that users install: what is in it, and that it runs where nothing else is."""

import importlib
import os
import subprocess
import sys
import textwrap
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "build_extension.py"


@pytest.fixture(scope="module")
def archive(bpy, tmp_path_factory):
    output = tmp_path_factory.mktemp("dist")
    built = subprocess.run([sys.executable, SCRIPT, f"--output={output}"], capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    (archive,) = output.glob("*.zip")
    assert str(archive) in built.stdout
    return archive


def test_the_zip_holds_the_two_packages_and_no_junk(archive):
    names = zipfile.ZipFile(archive).namelist()
    assert {name.split("/")[0] for name in names} <= {
        "blender_manifest.toml",
        "__init__.py",
        "core",
        "vad_addon",
        "README.md",
        "LICENSE",
    }
    assert {"__init__.py", "blender_manifest.toml", "core/settings.py", "vad_addon/operators.py"} <= set(names)
    assert not [name for name in names if "__pycache__" in name or "/." in name]
    assert archive.stat().st_size < 1_000_000


def test_what_lies_beside_the_project_is_not_shipped(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(SCRIPT.parent)
    build = importlib.import_module("build_extension")
    for name in (*build.SHIPPED[:4], "core/a.py", "vad_addon/b.py"):
        (tmp_path / "checkout" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "checkout" / name).write_text("")
    wanted = {path.relative_to(tmp_path / "checkout") for path in (tmp_path / "checkout").rglob("*.*")}
    for name in ("scan.ply", "out/scan.vdb", "core/__pycache__/a.pyc", "vad_addon/.hidden"):
        (tmp_path / "checkout" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "checkout" / name).write_text("")
    monkeypatch.setattr(build, "ROOT", tmp_path / "checkout")
    build._stage(tmp_path / "stage")
    staged = {path.relative_to(tmp_path / "stage") for path in (tmp_path / "stage").rglob("*.*")}
    assert staged == wanted
    assert (tmp_path / "stage" / "LICENSE").exists()


def test_one_version_everywhere():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert manifest["version"] == project["project"]["version"]


INSTALL_AND_RUN = """
    import sys

    for name in ("igl", "matplotlib", "plyfile", "skimage", "torch", "tqdm"):
        sys.modules[name] = None  # Blender ships none of these

    import bpy
    import addon_utils
    import numpy as np

    addon_utils.enable("bl_pkg", default_set=True)
    bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)

    points = np.random.default_rng(0).normal(size=(500, 3))
    data = bpy.data.meshes.new("Scan")
    data.from_pydata((points / np.linalg.norm(points, axis=1, keepdims=True)).tolist(), [], [])
    obj = bpy.data.objects.new("Scan", data)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    assert bpy.ops.vad.reconstruct(resolution=32) == {"FINISHED"}
    assert "core" not in sys.modules
    print("objects:", sorted(obj.name for obj in bpy.context.scene.vad.result.objects))
    print("volume:", bpy.data.volumes[0].filepath)
"""


RUN_LATER = """
    import sys

    import bpy

    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.vad")
    assert bpy.ops.vad.import_points(filepath=sys.argv[1]) == {"FINISHED"}
    assert bpy.ops.vad.reconstruct(resolution=32) == {"FINISHED"}
    print("objects:", sorted(obj.name for obj in bpy.context.scene.vad.result.objects))
"""


@pytest.mark.slow
def test_the_installed_zip_runs_in_a_fresh_blender_and_in_a_later_one(archive, tmp_path):
    ran = run(INSTALL_AND_RUN, archive, tmp_path)
    assert "objects: ['Scan field', 'Scan samples', 'Scan surface']" in ran.stdout
    (volume,) = (tmp_path / "user").rglob("*.vdb")
    assert f"volume: {volume}" in ran.stdout
    points = np.random.default_rng(0).normal(size=(500, 3))
    np.savetxt(tmp_path / "ball.xyz", points / np.linalg.norm(points, axis=1, keepdims=True))
    ran = run(RUN_LATER, tmp_path / "ball.xyz", tmp_path)
    assert "objects: ['ball field', 'ball samples', 'ball surface']" in ran.stdout


def run(text, argument, folder):
    """Runs the script `text` in a Blender of its own, whose files are in the folder."""
    script = folder / "script.py"
    script.write_text(textwrap.dedent(text))
    ran = subprocess.run(
        [sys.executable, script, argument],
        cwd=folder,
        env=os.environ | {"BLENDER_USER_RESOURCES": str(folder / "user")},
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "Traceback" not in ran.stderr
    return ran
