"""Memory used by this process, and where it is short."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_NO_THREAD = "can't start new thread"  # as Python says it


def peak_memory_mb() -> float | None:
    """Largest resident size of the process so far, MiB; None where nothing counts it: on Windows, whose counter is not
    in the standard library, and in sandboxes without /proc.

    On Linux from /proc, because the counter of `getrusage` starts at the parent's peak.
    """
    if sys.platform == "win32":
        return None
    if sys.platform == "linux":
        with suppress(OSError, IndexError):
            return int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) / 2**10
        return None
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


@contextmanager
def starting_threads() -> Iterator[None]:
    """Within, it is a MemoryError, not a RuntimeError, that no thread can be started: each takes memory of its own."""
    try:
        yield
    except RuntimeError as error:
        if _NO_THREAD not in str(error):
            raise
        raise MemoryError("no further thread can be started") from error
