"""Where the .vdb files live: Blender's volumes are always read from disk."""

import atexit
import contextlib
import os
import shutil
import time
from itertools import count
from pathlib import Path
from uuid import uuid4

import bpy
from bpy.app.handlers import persistent

from ..core.errors import VADError
from ..core.io.atomic import atomic_path, writable_folder
from . import results

PACKAGE = __package__.rpartition(".")[0]

_QUITTING = 20.0  # seconds that Blender may take to quit
_SUBFOLDER = "vad_cache"  # so that clearing it deletes nothing else
_STAYS, _LOST = "The volume stays in the cache folder: ", "The volume is lost: "
_session = uuid4().hex[:8]  # the folder in the cache folder that this session's volumes wait in
_taken = set()  # paths that this session made a file at, whose contents Blender may hold for as long as it runs
_made = set()  # files of this session that may be out of use once its undo history is gone
_copies = {}  # (file in the cache folder, when it was made, folder beside a .blend): its copy there
_LONGEST = 200  # bytes of a file's name, of 255 that there may be, before its number
_before = {}  # the volumes that the save under way brings along, by `session_uid`: what they read before


def adopt(name: str, temporary: Path, folder: Path | None = None) -> Path:
    """Copy the .vdb `temporary` to where it lasts, as a new file `name`.vdb, whole or not at all, and return its path.

    folder : beside a .blend, None for :func:`folder_in_use`
    Raises :class:`VADError` where the folder cannot be written.
    """
    beside = folder is not None or bpy.data.is_saved
    otherwise = "save the .blend in another folder" if beside else "save the .blend, or choose another cache folder"
    path = _reserve(name, folder or folder_in_use(), otherwise)
    try:
        with atomic_path(path, otherwise) as copy:
            shutil.copyfile(temporary, copy)
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    _made.add(path.resolve())
    return path


def used() -> set[Path]:
    """The .vdb files that volumes of the open .blend read."""
    return {file_of(volume) for volume in bpy.data.volumes}


def file_of(volume: bpy.types.Volume) -> Path:
    """The .vdb file that `volume` reads. Blender takes `..` for the folder that is written before it, even where that
    is a link to another place."""
    return Path(os.path.normpath(bpy.path.abspath(volume.filepath, library=volume.library))).resolve()


@persistent
def bring_along(blend: str = "", *_) -> None:
    """Before the file `blend` is saved (none: the startup file): what its volumes read in a cache folder is copied
    beside it, and they read the copies from then on. Where that fails they go on reading the cache folder, and the
    results say so, as they do where another session has cleared that."""
    _before.clear()
    if not blend:
        return
    folder, caches = Path(blend).absolute().parent / "vad", {cache_folder().resolve(), own_folder().resolve()}
    here = bpy.data.is_saved and Path(bpy.data.filepath).parent == folder.parent
    for volume in bpy.data.volumes:
        path = file_of(volume)
        cached = _SUBFOLDER in path.parts or not caches.isdisjoint(path.parents)
        if volume.library is not None or not cached or path.parent == folder.resolve():
            continue
        _before[volume.session_uid] = volume.filepath
        if not path.is_file():
            _warn(volume, f"{_LOST}{path} is not there any more; press Extract Again")
            continue
        try:
            copy = _copy(path, folder)
        except (VADError, OSError) as error:
            _warn(volume, f"{_STAYS}{error}")
            continue
        _warn(volume, "")
        volume.filepath = bpy.path.relpath(str(copy)) if here else str(copy)  # Blender makes it relative, if it is to


@persistent
def keep_saved(blend: str = "", *_) -> None:
    """After a save: the files that the .blend now reads stay for good. Where it was a copy that was saved, what goes on
    being edited reads what it read before."""
    _made.difference_update(used())
    if blend != bpy.data.filepath:
        put_back()


@persistent
def put_back(*_) -> None:
    """After a save that failed: the volumes read what they read before."""
    for volume in bpy.data.volumes:
        if volume.session_uid in _before:
            volume.filepath = _before[volume.session_uid]
    _before.clear()


def _copy(path, folder):
    key = path, path.stat().st_mtime_ns, folder
    copy = _copies.get(key)
    if copy is None or not copy.is_file():
        copy = _copies[key] = adopt(path.stem, path, folder)
    return copy


def _warn(volume, problem):
    """Show this problem, and no earlier one, with the results that `volume` belongs to."""
    for collection in bpy.data.collections:
        of_run = *collection.objects, *results.members(collection)
        if results.REPORT in collection and any(obj.data == volume for obj in of_run):
            others = [line for line in results.warnings(collection) if not line.startswith((_STAYS, _LOST))]
            collection[results.WARNINGS] = "\n".join([*others, *([problem] if problem else [])])


@persistent
def delete_unused(*_) -> None:
    """Delete the files that were made since the last call, read by no saved .blend and not by the open one: volumes
    that were updated, undone or deleted. Call it when the undo history, which could bring these back, is gone."""
    _delete(_made - used())
    _made.clear()


def delete_unused_at_exit() -> None:
    """The same at the end of the session. Blender disables its extensions then; so does the user at times, who can
    undo and save afterwards, and nothing tells one from the other but how soon the end comes."""
    atexit.unregister(delete_unused)
    atexit.register(_delete_if_soon, _made - used(), time.monotonic() + _QUITTING)


def delete_unused_of_module() -> None:
    """The same where Blender is a module of Python, which disables no extensions at its end."""
    if bpy.app.module:
        atexit.register(delete_unused)


def _delete_if_soon(paths, deadline):
    if time.monotonic() < deadline:
        _delete(paths)


def _delete(paths):
    for path in paths:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
            if path.parent.name == _session:
                path.parent.rmdir()  # once it is empty


def blender_path(path: Path) -> str:
    """`path` as a data-block stores it: relative to the .blend once that is saved, so that both move together."""
    return bpy.path.relpath(str(path)) if bpy.data.is_saved else str(path)


def _reserve(name, folder, otherwise):
    """Create an empty file that nobody else uses. Names that exist already are counted up and never reused: an older
    volume, an undone one or another .blend may read them. Nor are those of files that are gone: Blender goes on showing
    what it once read at a path. Names of objects may be longer than those of files."""
    folder = writable_folder(folder, otherwise)
    stem = bpy.path.clean_name(name).encode()[:_LONGEST].decode(errors="ignore")
    names = (f"{stem}_{number:03d}.vdb" if number else f"{stem}.vdb" for number in count())
    path = next(path for path in map(folder.joinpath, names) if path.resolve() not in _taken and _made_now(path))
    _taken.add(path.resolve())
    return path


def _made_now(path):
    """Whether an empty file was made, as there was none."""
    with contextlib.suppress(FileExistsError):
        path.touch(exist_ok=False)
        return True
    return False


def folder_in_use() -> Path:
    """``//vad`` beside a saved .blend, else one of this session in :func:`cache_folder`: files that Blender recovers
    after a crash may read what is gone, and should not find another scan's in its place."""
    return Path(bpy.path.abspath("//vad")) if bpy.data.is_saved else cache_folder() / _session


def cache_folder() -> Path:
    """Where volumes of a .blend that was never saved go: a folder in the one that the user prefers, else
    :func:`own_folder`."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    preferred = addon.preferences.cache if addon and addon.preferences else ""
    return Path(bpy.path.abspath(preferred)) / _SUBFOLDER if preferred else own_folder()


def own_folder() -> Path:
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
    """Delete the volumes in the cache folder that no data-block of this file reads, nor may read once something is
    undone; returns the bytes freed.

    Raises :class:`VADError` where one cannot be deleted.
    """
    kept = used() | _made
    freed = 0
    for path in list(cache_folder().rglob("*.vdb")):
        if path.resolve() not in kept:
            size = path.stat().st_size
            try:
                path.unlink()
            except OSError as error:
                raise VADError(f"{path} cannot be deleted ({error.strerror}); delete it by hand") from error
            freed += size
            if path.parent != cache_folder():
                with contextlib.suppress(OSError):
                    path.parent.rmdir()  # once it is empty
    return freed
