"""`python -m benchmarks.make_cases FOLDER`: write the cases made by script, so that the bench needs no other data."""

import argparse
import sys
from pathlib import Path

from core import InputError
from core.io.atomic import writable_folder

from .catalogue import CASES, make_case
from .status import DONE, exit_status


def main(arguments: list[str] | None = None) -> int:
    """Run on `arguments` (default: those of the process) and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.make_cases", description=__doc__)
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--quick", action="store_true", help="only the small set of `make bench`")
    parser.add_argument("--cases", metavar="A,B", type=lambda text: text.split(","), help="only these")
    given = parser.parse_args(arguments)

    def command():
        names = given.cases or [name for name, recipe in CASES.items() if recipe.quick or not given.quick]
        unknown = [name for name in names if name not in CASES]
        if unknown:
            raise InputError(f"no case is called {', '.join(unknown)}; there are {', '.join(CASES)}")
        folder = writable_folder(given.folder)
        for name in names:
            if (folder / f"{name}.npz").exists():
                print(f"{name} is there")
            else:
                print(f"made {make_case(folder, name)}", flush=True)
        return DONE

    return exit_status(command)


if __name__ == "__main__":
    sys.exit(main())
