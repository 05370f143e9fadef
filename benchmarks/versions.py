"""What a page was measured with."""

import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version

from .kept import OURS, code_version


def versions(libraries: Iterable[str]) -> dict[str, str]:
    """Of our code, eight digits that change with it, of Python and of those libraries that are installed, by name."""
    found = {"our code": code_version(OURS), "Python": platform.python_version()}
    for name in libraries:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def listed(found: dict[str, str]) -> str:
    """These as a sentence, without its end."""
    return "Measured with " + ", ".join(f"{name} {number}" for name, number in found.items())
