"""Where the .vdb files live: Blender's volumes are always read from disk."""

import shutil
from pathlib import Path

import bpy

from ..core.errors import VADError
from ..core.io.atomic import atomic_path, writable_folder

PACKAGE = __package__.rpartition(".")[0]


def adopt(name: str, temporary: Path) -> Path:
    """Copy the .vdb `temporary` to where it lasts, as a new file `name`.vdb, whole or not at all, and return its path.

    Raises :class:`VADError` where the folder cannot be written.
    """
    path = _reserve(name)
    try:
        with atomic_path(path) as copy:
            shutil.copyfile(temporary, copy)
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
    folder = writable_folder(folder_in_use())
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


def folder_in_use() -> Path:
    """``//vad`` beside a saved .blend, else :func:`cache_folder`."""
    return Path(bpy.path.abspath("//vad")) if bpy.data.is_saved else cache_folder()


def cache_folder() -> Path:
    """The extension's own folder, which outlives the session; else, when the code runs from a checkout and owns no such
    folder, the session's temporary one."""
    if PACKAGE.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(PACKAGE, path="cache", create=True))
    return Path(bpy.app.tempdir) / "vad"


def cache_contents() -> tuple[int, int]:
    """Number and total size, in bytes, of the volumes in the cache folder."""
    sizes = [path.stat().st_size for path in cache_folder().rglob("*.vdb")]
    return len(sizes), sum(sizes)


def clear_cache() -> int:
    """Delete the volumes in the cache folder that no data-block of this file reads; returns the bytes freed.

    Raises :class:`VADError` where one cannot be deleted.
    """
    used = {Path(bpy.path.abspath(volume.filepath)).resolve() for volume in bpy.data.volumes}
    freed = 0
    for path in cache_folder().rglob("*.vdb"):
        if path.resolve() not in used:
            size = path.stat().st_size
            try:
                path.unlink()
            except OSError as error:
                raise VADError(f"{path} cannot be deleted ({error.strerror}); delete it by hand") from error
            freed += size
    return freed
