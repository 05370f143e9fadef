"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import local
from uuid import uuid4

from ..errors import VADError
from .paths import path_of

ELSEWHERE = "choose another folder"  # what helps, in most places

_kept = local()  # `waiting`, the files that are to take their places together, where some are: (temporary, path)


@contextmanager
def together() -> Iterator[None]:
    """Within, files of :func:`atomic_path` wait for each other: they take their places in the order they were written,
    when the block ends without an error and all of them can, else none of them does.

    The last one tells of the others: an old one in its place goes before they do, so that it is never untrue.
    """
    _kept.waiting = waiting = []
    try:
        yield
        _take_places(waiting)
    finally:
        del _kept.waiting
        for temporary, _ in waiting:
            _remove(temporary)


def _take_places(waiting):
    """Put files, (temporary, path) each, in their places, for what is there; it comes back where one cannot be put."""
    before, new = [], []
    try:
        for _, path in reversed(waiting):
            if path.is_file():
                with _errors_of(path), suppress(FileNotFoundError):  # another program took it away
                    before.append((_beside(path), path))
                    os.replace(path, before[-1][0])
        for temporary, path in waiting:
            with _errors_of(path):
                os.replace(temporary, path)
                new.append(path)
    except BaseException:
        for path in new:
            _remove(path)
        for old, path in reversed(before):
            with suppress(OSError):
                os.replace(old, path)
        raise
    for old, _ in before:
        _remove(old)


def _beside(path):
    """A path of no file, in the same folder, and hidden; what is found there later was left by a program that had to
    end at once."""
    return path.with_name(f".unfinished-{uuid4().hex}{path.suffix}")


@contextmanager
def atomic_path(path: str | os.PathLike, otherwise: str = ELSEWHERE) -> Iterator[Path]:
    """Yield a temporary path beside `path` to write to; it takes `path`'s place when the block ends without an error,
    or later, see :func:`together`.

    Whatever else happens, Ctrl-C included, `path` stays as it was and the temporary file is removed. An OSError
    (folder missing or not writable, disk full) becomes a :class:`VADError` of one line, which says what to do
    `otherwise`.
    """
    path = path_of(path)
    if not path.name:
        raise VADError(f"'{path}' is a folder; give the path of a file")
    temporary = _beside(path)
    waiting = getattr(_kept, "waiting", None)
    try:
        with _errors_of(path, otherwise):
            yield temporary
            with open(temporary, "rb+") as file:
                os.fsync(file.fileno())
            if waiting is None:
                os.replace(temporary, path)
    except BaseException:
        _remove(temporary)
        raise
    if waiting is not None:
        waiting.append((temporary, path))


@contextmanager
def _errors_of(path, otherwise=ELSEWHERE):
    """Makes a :class:`VADError` of one line, that names the file, of an OSError."""
    try:
        yield
    except OSError as error:
        raise VADError(
            f"{path} cannot be written ({error.strerror or error}); free space there or {otherwise}"
        ) from error


def _remove(temporary):
    with suppress(OSError):  # an unreachable folder was reported before
        temporary.unlink(missing_ok=True)


def writable_folder(path: str | os.PathLike, otherwise: str = ELSEWHERE) -> Path:
    """Make the folder `path` where it is missing, and prove that files can be made in it. Raises :class:`VADError`,
    which says what to do `otherwise`."""
    path = path_of(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        raise VADError(f"nothing can be written into {path} ({error.strerror}); {otherwise}") from error
