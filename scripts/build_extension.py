"""Build and validate the extension's zip in dist/.

    .venv/bin/python scripts/build_extension.py             one zip, which uses the SciPy of Blender's Python
    .venv/bin/python scripts/build_extension.py --wheels    one per platform, with SciPy for Blender 4.5 to 5.2

Needs the `bpy` package in the running Python, whose build tool it calls, or a Blender by --blender PATH.
"""

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

SHIPPED = "blender_manifest.toml", "__init__.py", "LICENSE", "README.md", "core", "vad_addon"

SCIPY = {"3.11": "1.17.1", "3.13": "1.18.1"}  # Blender 4.5-5.0 and 5.1-5.2
PLATFORMS = {
    "linux-x64": ["manylinux_2_28_x86_64"],
    "windows-x64": ["win_amd64"],
    "windows-arm64": ["win_arm64"],
    "macos-arm64": ["macosx_12_0_arm64"],
    "macos-x64": ["macosx_10_14_x86_64", "macosx_14_0_x86_64"],  # pip takes the first that exists
}


def main():
    arguments = _arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    builder = _builder(arguments.blender)
    with tempfile.TemporaryDirectory() as folder:
        stage, built = Path(folder, "stage"), Path(folder, "built")
        built.mkdir()
        _stage(stage)
        if arguments.wheels:
            _add_wheels(stage)
        split = ["--split-platforms"] if arguments.wheels else []
        subprocess.run([*builder, "build", f"--source-dir={stage}", f"--output-dir={built}", *split], check=True)
        for archive in sorted(built.glob("*.zip")):
            subprocess.run([*builder, "validate", str(archive)], check=True)
            print(shutil.copy2(archive, arguments.output))


def _arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wheels", action="store_true", help="download SciPy and build one zip per platform")
    parser.add_argument("--blender", type=Path, help="Blender executable to build with, in place of the bpy package")
    parser.add_argument("--output", type=Path, default=ROOT / "dist", help="folder for the zips (default: dist)")
    return parser.parse_args()


def _builder(blender):
    """The command line of Blender's extension tool. `bpy` is located, not imported: that would start Blender."""
    if blender:
        return [str(blender), "--command", "extension"]
    spec = importlib.util.find_spec("bpy")
    if spec is None:
        sys.exit(f"no bpy package in {sys.executable}: pip install bpy, or pass --blender PATH")
    (tool,) = Path(spec.submodule_search_locations[0]).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    return [sys.executable, str(tool)]


def _stage(stage):
    """Copy what the extension needs, and nothing that lies beside it, such as a user's scans and results."""
    stage.mkdir()
    for name in SHIPPED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, stage / name, ignore=shutil.ignore_patterns("__pycache__", ".*"))
        else:
            shutil.copy2(source, stage)


def _add_wheels(stage):
    wheels = stage / "wheels"
    for python, version in SCIPY.items():
        for tags in PLATFORMS.values():
            platforms = [f"--platform={tag}" for tag in tags]
            download = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:"]
            target = [f"--python-version={python}", "--implementation=cp", f"--dest={wheels}", f"scipy=={version}"]
            subprocess.run([*download, *platforms, *target], check=True)
    manifest = stage / "blender_manifest.toml"
    names = [f"./wheels/{wheel.name}" for wheel in sorted(wheels.iterdir())]
    manifest.write_text(f"wheels = {names}\nplatforms = {list(PLATFORMS)}\n" + manifest.read_text("utf-8"), "utf-8")


if __name__ == "__main__":
    main()
