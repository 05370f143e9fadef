"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from ..errors import VADError


@contextmanager
def atomic_path(path: str | os.PathLike) -> Iterator[Path]:
    """Yield a temporary path beside `path` to write to; it takes `path`'s place when the block ends without an error.

    Whatever else happens, Ctrl-C included, `path` stays as it was and the temporary file is removed. An OSError
    (folder missing or not writable, disk full) becomes a :class:`VADError` of one line.
    """
    path = Path(path)
    if not path.name:
        raise VADError(f"'{path}' is a folder; give the path of a file")
    temporary = path.with_name(f".{uuid4().hex}{path.suffix}")
    try:
        yield temporary
        with open(temporary, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise VADError(
            f"{path} cannot be written ({error.strerror or error}); free space there or choose another folder"
        ) from error
    finally:
        with suppress(OSError):  # an unreachable folder was reported above
            temporary.unlink(missing_ok=True)


def writable_folder(path: str | os.PathLike) -> Path:
    """Make the folder `path` where it is missing, and prove that files can be made in it. Raises :class:`VADError`."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        raise VADError(f"nothing can be written into {path} ({error.strerror}); choose another folder") from error
