"""What the benchmarks' commands share: exit statuses, and the command of a module that writes one page."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from core import VADError

DOCS = Path(__file__).resolve().parent.parent / "docs"
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


def word(met: bool) -> str:
    """What is said of a target first."""
    return "**Met**" if met else "**Missed**"


def said(what: str, result):
    """The result, once it is printed what was done."""
    print(what, flush=True)
    return result


def page_command(arguments: list[str] | None, module: str, description: str, needs: str, write: Callable) -> int:
    """Run `write`, a function of the folder of cases that writes a page and returns its path, on `arguments` (None:
    those of the process), and return the exit status. `needs` says what the folder holds."""
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks.{module}",
        description=description,
        epilog="exit status: 0 done, 2 bad input (one line says what), 130 cancelled",
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path, help=needs)
    given = parser.parse_args(arguments)

    def command():
        print(f"wrote {write(given.folder)}")
        return DONE

    return exit_status(command)
