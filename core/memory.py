"""Memory used by this process."""

import sys
from pathlib import Path


def peak_memory_mb() -> float | None:
    """Largest resident size of the process so far, MiB; None on Windows, which has no such counter in the standard
    library.

    On Linux from /proc, because the counter of `getrusage` starts at the parent's peak.
    """
    if sys.platform == "win32":
        return None
    if sys.platform == "linux":
        status = Path("/proc/self/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0]) / 2**10
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
