"""Where the .vdb files live: Blender's volumes are always read from disk."""

from pathlib import Path

import bpy

from ..core.field.distance_field import DistanceField
from ..core.io.atomic import writable_folder
from ..core.io.vdb import write_vdb

PACKAGE = __package__.rpartition(".")[0]


def write(name: str, field: DistanceField) -> Path:
    """Write the grids of `field` to a new file `name`.vdb, whole or not at all, and return its path.

    Raises :class:`VADError` where the folder cannot be written and :class:`MissingDependency` without OpenVDB.
    """
    path = _reserve(name)
    try:
        write_vdb(path, field, gradient=False)
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    return path


def blender_path(path: Path) -> str:
    """`path` as a data-block stores it: relative to the .blend once that is saved, so that both move together."""
    return bpy.path.relpath(str(path)) if bpy.data.is_saved else str(path)


def _reserve(name):
    """Create an empty file that nobody else uses. Names that exist already are counted up and never reused: an older
    volume, an undone one or another .blend may read them."""
    folder = writable_folder(_folder())
    stem = bpy.path.clean_name(name)
    path, number = folder / f"{stem}.vdb", 0
    while True:
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            number += 1
            path = folder / f"{stem}_{number:03d}.vdb"
        else:
            return path


def _folder():
    """``//vad`` beside a saved .blend; else the extension's own folder, which outlives the session; else, when the code
    runs from a checkout and owns no such folder, the session's temporary one."""
    if bpy.data.is_saved:
        return Path(bpy.path.abspath("//vad"))
    if PACKAGE.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(PACKAGE, path="cache", create=True))
    return Path(bpy.app.tempdir) / "vad"
