"""`make demo`: reconstruct the bundled scan as the command line does, and draw a picture of the files it wrote."""

import sys
from pathlib import Path

from core.cli import main as command_line

from .outputs import read_field, read_mesh, read_points
from .picture import save_picture

ROOT = Path(__file__).resolve().parent.parent
SCAN = ROOT / "tests" / "data" / "bust.ply"
OUTPUT = ROOT / "demo"
TOWARDS_VIEWER = -0.05, -1.0, 0.1
ACROSS_X = 0
GUIDE = {
    ".png": "the scan, its normals, its distance field and its surface at a glance",
    "_double.ply": "the surface, two-sided: any mesh viewer; in Blender, File > Import > Stanford PLY",
    ".vdb": "the distance field: in Blender, Add > Volume > Import OpenVDB",
    "_points.ply": "the points with their normals: opens like the surface",
    "_single.ply": "the same surface as one sheet, open where the scan is open",
}


def main() -> int:
    status = command_line(["reconstruct", str(SCAN), "-o", str(OUTPUT), "--surface", "both"])
    if status:
        return status

    picture, mesh, volume, samples, _ = (OUTPUT / f"{SCAN.stem}{ending}" for ending in GUIDE)
    points, normals = read_points(samples)
    save_picture(picture, points, normals, read_field(volume), read_mesh(mesh), TOWARDS_VIEWER, ACROSS_X)

    print(f"\nOpen next, in {OUTPUT}:")
    for ending, hint in GUIDE.items():
        print(f"  {SCAN.stem + ending:<18}{hint}")
    print("The same from Blender's sidebar: `.venv/bin/python scripts/build_extension.py --wheels`, then drop the zip")
    print("for your platform from dist/ onto Blender's window.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
