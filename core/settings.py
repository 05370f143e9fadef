"""The one place where an option, its default, its limits and its help live.

The command line, the Blender panel and the README's table are generated from :class:`Settings` or tested against it.
"""

import dataclasses
import numbers
from dataclasses import dataclass

from .errors import SettingsError


def _option(default, help, *, limits=None, choices=None, unit=""):
    return dataclasses.field(default=default, metadata=dict(help=help, limits=limits, choices=choices, unit=unit))


@dataclass(frozen=True)
class Settings:
    """Validated, immutable options of a run. Raises :class:`SettingsError` for a value outside its limits."""

    resolution: int = _option(
        128,
        "Grid cells along the longest side of the padded box. Twice the resolution shows detail half the size and "
        "costs four to eight times the time and memory",
        limits=(16, 512),
        unit="cells",
    )
    bridge: float = _option(
        3.0,
        "Gaps up to this wide are closed and wider ones stay open, in units of the local distance between points. "
        "Raise it where the surface has pinholes, lower it where openings grow shut",
        limits=(1.5, 20.0),
        unit="local spacings",
    )
    offset: float = _option(
        1.0,
        "Distance at which the two layers of the surface are first extracted, before they are pulled onto it. "
        "Larger tolerates rougher fields, smaller separates closer sheets",
        limits=(0.5, 4.0),
        unit="cells",
    )
    surface: str = _option(
        "double",
        "Mesh to extract: the closed two-sided cover of the surface, or none (field and normals only)",
        choices=("double", "none"),
    )
    solver: str = _option(
        "reflection",
        "How normals are found: by reflections across the Voronoi bisectors, or by a plain local plane fit (PCA), "
        "which is the baseline to compare with",
        choices=("reflection", "pca"),
    )
    seed: int = _option(
        0,
        "Seed of the tiny jitter that keeps the Voronoi diagram of regular grids fast; same seed, same bytes",
        limits=(0, 2**31 - 1),
    )

    def __post_init__(self):
        for option in dataclasses.fields(self):
            object.__setattr__(self, option.name, _checked(option, getattr(self, option.name)))


def options() -> dict[str, dataclasses.Field]:
    """Name -> dataclass field of every setting: `.default`, `.type` and `.metadata` with help, limits, choices, unit."""
    return {option.name: option for option in dataclasses.fields(Settings)}


def _checked(option, value):
    name, metadata = option.name, option.metadata
    if metadata["choices"]:
        if value not in metadata["choices"]:
            raise SettingsError(f"{name} is {value!r}; choose one of {', '.join(metadata['choices'])}")
        return value
    kind = numbers.Integral if option.type is int else numbers.Real
    low, high = metadata["limits"]
    if isinstance(value, bool) or not isinstance(value, kind) or not low <= value <= high:
        what = "a whole number" if option.type is int else "a number"
        raise SettingsError(f"{name} is {value!r}; it must be {what} from {low} to {high}")
    return option.type(value)
