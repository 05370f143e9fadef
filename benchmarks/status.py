"""Exit statuses of the benchmarks' commands."""

import sys
from collections.abc import Callable

from core import VADError

DONE, CASE_FAILED, BAD_INPUT, CANCELLED = 0, 1, 2, 130


def exit_status(command: Callable[[], int]) -> int:
    """What `command` returns; where it raises a :class:`VADError` or is interrupted, one line on stderr and the status
    for that."""
    try:
        return command()
    except VADError as error:
        print(f"error: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("error: cancelled", file=sys.stderr)
        return CANCELLED
