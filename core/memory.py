"""Memory used by this process."""

import sys


def peak_memory_mb() -> float | None:
    """Largest resident size of the process so far, MiB; None on Windows, which has no such counter in the standard
    library."""
    if sys.platform == "win32":
        return None
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10
