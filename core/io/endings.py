"""File names that say what is in the files: other programs go by their endings."""

import os
from pathlib import Path

from ..errors import InputError


def ending_in(ending: str, path: str | os.PathLike) -> Path:
    """The path, that of a file of the type which `ending` stands for, with its dot. Raises :class:`InputError` where it
    ends in something else, upper and lower case aside."""
    path = Path(path)
    if path.name and path.suffix.lower() != ending:
        name = path.stem if path.stem.lower().endswith(ending) else f"{path.stem}{ending}"
        raise InputError(f"'{path}' does not end in {ending}, which is what is written; name it {name}")
    return path
