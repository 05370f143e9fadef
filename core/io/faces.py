"""Faces of meshes from files, of which points are read elsewhere."""

from pathlib import Path

import numpy as np

from .read_text import obj_faces


def read_faces(path: Path, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The vertices around each face of a .ply or .obj file, one face after another, (c,) int64, and how many each has,
    (f,) int64; `count` vertices could be read of it. None for other files, and where the faces are not sound."""
    read = {".ply": _ply_faces, ".obj": obj_faces}.get(path.suffix.lower())
    try:
        found = read(path) if read else []
        faces = [face for face in found if len(face)]
        corners = np.concatenate([np.empty(0, np.int64), *faces])
    except (ValueError, OverflowError):
        faces, corners = [], np.empty(0, np.int64)
    if corners.dtype.kind == "f" or not ((corners >= 0) & (corners < count)).all():
        faces, corners = [], np.empty(0, np.int64)
    return corners, np.array([len(face) for face in faces], np.int64)


def _ply_faces(path):
    from .read_ply import ply_faces  # Blender has no plyfile

    return ply_faces(path)
