"""Paths of files as a caller gives them, checked."""

import os
from pathlib import Path

from ..errors import InputError


def path_of(given: str | os.PathLike) -> Path:
    """The path that is given. Raises :class:`InputError` for what is none, or one that no file can have."""
    try:
        path = Path(given)
        if b"\0" in os.fsencode(path):
            raise ValueError("it holds a null character")
    except (TypeError, ValueError) as error:
        raise InputError(f"{given!r} is not the path of a file ({error}); give text, or a pathlib.Path") from error
    return path


def ending_in(ending: str, given: str | os.PathLike) -> Path:
    """The path, that of a file of the type which `ending` stands for, with its dot: other programs go by the endings of
    names. Raises :class:`InputError` as :func:`path_of` does, and where it ends in something else, upper and lower case
    aside."""
    path = path_of(given)
    if path.name and path.suffix.lower() != ending:
        name = path.stem if path.stem.lower().endswith(ending) else f"{path.stem}{ending}"
        raise InputError(f"'{path}' does not end in {ending}, which is what is written; name it {name}")
    return path
