"""Build and validate the extension's zip in dist/.

    python scripts/build_extension.py                 one zip that uses the SciPy it finds in Blender's Python
    python scripts/build_extension.py --wheels        one zip per platform, each carrying SciPy for Blender 4.5 to 5.2

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
    """Copy the project's own files, and nothing a checkout gathers over time; the manifest excludes the rest."""
    for path in _project_files():
        target = stage / path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / path, target)


def _project_files():
    if (ROOT / ".git").exists():
        listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(listing, cwd=ROOT, check=True, capture_output=True, text=True).stdout
        return [Path(name) for name in names.split("\0") if name and (ROOT / name).is_file()]
    files = (path.relative_to(ROOT) for path in ROOT.rglob("*") if path.is_file())
    return [path for path in files if not any(part.startswith(".") for part in path.parts)]


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
