"""The one place where an option, its default, its limits and its help live.

The command line, the Blender panel and the README's table are generated from :class:`Settings` or tested against it.
"""

import dataclasses
import numbers
from dataclasses import dataclass
from math import ceil

import numpy as np

from .errors import SettingsError
from .field.grid import padding_cells

WHOLE_BOX = 512  # cells, the finest resolution without a band
BESIDE_OFFSET = 2  # cells that a band reaches beyond the offset, at least


def _option(default, help, *, limits=None, choices=None, word=None, unit=""):
    """A field; `word` is the one text that stands for a value found from the data, or for the default None, where
    `limits` ask for a number; `choices` are what it may be, and what each of these means."""
    names = choices and tuple(choices)
    metadata = dict(help=help, limits=limits, choices=names, meanings=choices, word=word, unit=unit)
    return dataclasses.field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Settings:
    """Validated, immutable options of a run. Raises :class:`SettingsError` for a value outside its limits."""

    resolution: int = _option(
        128,
        "Grid cells along the longest side of the padded box. Twice the resolution shows detail half the size and "
        "costs one and a half to six times the time and memory, less where points are many; once these are a cell and "
        "a half apart, finer ones mostly show hardly more. Beyond 512 a band is needed",
        limits=(16, 2048),
        unit="cells",
    )
    band: float | None = _option(
        None,
        "Evaluate the distance only this near the surface, or in the whole box. With a band, 4 for instance, time and "
        "memory grow with the surface, not with the box; the meshes hardly change",
        limits=(3.0, 32.0),
        word="none",
        unit="cells",
    )
    bridge: float = _option(
        3.0,
        "Gaps up to this wide are closed and wider ones stay open, in units of the local distance between points; "
        "those that chance leaves among random points are closed up to half as wide again, those between lines of "
        "points (wires, contours, lines of a scanner) up to five times as wide. "
        "Raise it where the surface has pinholes, lower it where openings grow shut",
        limits=(1.5, 20.0),
        unit="local spacings",
    )
    offset: float = _option(
        1.0,
        "Distance at which the two layers of the double cover are first extracted, before they are pulled onto the "
        "surface, where they are not the two sides of a single layer: where points do not show where sheets "
        "cross, or sheets run side by side, or points are over five cells apart, or less than two thirds of one; at "
        "more where they are over three. "
        "Larger tolerates rougher fields, smaller separates closer sheets",
        limits=(0.5, 4.0),
        unit="cells",
    )
    surface: str = _option(
        "double",
        "Mesh to extract: the double cover, closed and two-sided; the single layer, one sheet that is open where the "
        "surface is open; both; the signed surface of a closed shape, with the field negative inside; or none (field "
        "and normals only)",
        choices={
            "double": "The double cover: closed, a layer on either side of every sheet",
            "single": "The single layer: one sheet, open where the surface is open",
            "both": "The double cover and the single layer",
            "signed": "The surface of a closed shape; distances in the field are negative inside",
            "none": "Field and normals only",
        },
    )
    faces: str = _option(
        "triangles",
        "What meshes are made of: triangles, or quads along the grid's axes, for subdivision and sculpting; a few "
        "triangles are kept where a surface ends and where sheets of a single layer meet",
        choices={
            "triangles": "Triangles alone",
            "quads": "Quads along the grid's axes, for subdivision and sculpting, and few triangles",
        },
    )
    pieces: float = _option(
        0.0,
        "Leave pieces out of a mesh that have less than this share of its largest piece's area, floating scraps for "
        "instance. Crumbs that show nothing of their own go in any case",
        limits=(0.0, 1.0),
    )
    solver: str = _option(
        "reflection",
        "How normals are found: by reflections across the Voronoi bisectors, by minimising the published energy on "
        "samples of the bisectors (slower, the reference), or by a plain local plane fit (PCA, the baseline)",
        choices={
            "reflection": "By reflections across the Voronoi bisectors",
            "energy": "By minimising the published energy on samples of the bisectors: slower, the reference",
            "pca": "By a plain local plane fit: the baseline",
        },
    )
    integration: str = _option(
        "transport",
        "How the distance gets from the surface to the rest of the box: carried outwards from the surface's points, or "
        "by the published Poisson equation (less exact, the reference)",
        choices={
            "transport": "Carried outwards from the surface's points",
            "poisson": "By the published Poisson equation: less exact, the reference",
        },
    )
    diffusion: str = _option(
        "kernel",
        "Where the Poisson equation takes its directions from: the diffusion's closed-form kernels, or the published "
        "diffusion on the grid (the reference; without rims, and refused where points are many, mostly above 2,000)",
        choices={
            "kernel": "From the diffusion's closed-form kernels",
            "grid": "From the published diffusion on the grid: the reference, for few points",
        },
    )
    backend: str = _option(
        "auto",
        "What differentiates the energy where the solver is energy: torch, NumPy, or torch where it is installed. "
        "Nothing else in a run uses torch",
        choices={
            "numpy": "NumPy, which is always there",
            "torch": "Torch, which has to be installed",
            "auto": "Torch where it is installed, else NumPy",
        },
    )
    device: str = _option(
        "auto",
        "Where torch differentiates the energy: on the processor, on an Nvidia GPU (cuda), or on the GPU where torch "
        "sees one. Nothing else in a run uses a GPU",
        choices={
            "cpu": "On the processor",
            "cuda": "On an Nvidia GPU",
            "auto": "On the GPU where torch sees one, else on the processor",
        },
    )
    outliers: bool = _option(
        True,
        "Drop stray points far from any surface, a few that lie further from all others than these do from each other, "
        "those inside a solid that points fill, and most points of lines along which they lie much closer than a cell "
        "is wide and the next line is away; what is dropped is said",
    )
    denoise: float | str = _option(
        "auto",
        "How far points are moved onto the smooth surface through their neighbours: not at all (0) to all the way (1). "
        "With auto all the way where the scan, or a good part of it, is found noisy, or is a frame of a depth camera "
        "whose depth comes in steps, else not at all",
        limits=(0.0, 1.0),
        word="auto",
    )
    memory_limit: float | str = _option(
        "auto",
        "A run that is estimated to need more memory than this is refused once its points are cleaned. With auto the "
        "limit is 70 % of the memory that is free",
        limits=(64.0, 2.0**22),
        word="auto",
        unit="MiB",
    )
    seed: int = _option(
        0,
        "Seed of the tiny jitter that keeps the Voronoi diagram of regular grids fast, and of the samples that noise "
        "is measured on; same seed, same results",
        limits=(0, 2**31 - 1),
    )

    def __post_init__(self):
        for option in dataclasses.fields(self):
            object.__setattr__(self, option.name, _checked(option, getattr(self, option.name)))
        if self.band is None and self.resolution > WHOLE_BOX:
            banded = f"set band, for instance to {max(4, ceil(self.offset + BESIDE_OFFSET))},"
            if self.integration == "poisson":
                banded += " and integration to transport," + " diffusion to kernel," * (self.diffusion == "grid")
            raise SettingsError(
                f"resolution is {self.resolution} and the whole box may have {WHOLE_BOX} cells at most; {banded} or "
                "lower the resolution"
            )
        if self.band is not None and self.integration == "poisson":
            raise SettingsError(
                f"band is {self.band:g} and integration 'poisson', which solves in the whole box; leave band at none, "
                "or set integration to transport"
            )
        if self.band is not None and self.band < self.offset + BESIDE_OFFSET:
            raise SettingsError(
                f"band is {self.band:g} and offset {self.offset:g}; use a band of {self.offset + BESIDE_OFFSET:g} or "
                "more, or lower the offset"
            )
        if self.resolution < self.coarsest:
            room = padding_cells(self.resolution)
            raise SettingsError(
                f"offset is {self.offset:g} and resolution {self.resolution}, which leaves {room:g} cells around the "
                f"points; use an offset of {room:g} or less, or a resolution of {self.coarsest} or more"
            )
        if self.diffusion == "grid" and self.integration != "poisson":
            raise SettingsError(
                f"diffusion is 'grid' and integration {self.integration!r}, which needs no directions away from the "
                "surface; set integration to poisson, or diffusion to kernel"
            )

    @property
    def coarsest(self) -> int:
        """The least resolution whose box has room for the iso-surface at `offset`, where there is to be one."""
        least = options()["resolution"].metadata["limits"][0]
        return least if self.surface in ("none", "signed") else max(least, ceil(self.offset / padding_cells(1)))


def options() -> dict[str, dataclasses.Field]:
    """Name -> field of each setting: its `.default`, `.type` and `.metadata` (help, limits, choices, meanings,
    word, unit)."""
    return {option.name: option for option in dataclasses.fields(Settings)}


def default_in_words(option: dataclasses.Field):
    """The default of a setting as a user types it: None is its word."""
    return option.metadata["word"] if option.default is None else option.default


def _checked(option, value):
    name, metadata = option.name, option.metadata
    if metadata["choices"]:
        if not isinstance(value, str) or value not in metadata["choices"]:
            raise SettingsError(f"{name} is {value!r}; choose one of {', '.join(metadata['choices'])}")
        return value
    if option.type is bool:
        if not isinstance(value, (bool, np.bool_)):
            raise SettingsError(f"{name} is {value!r}; it must be True or False")
        return bool(value)
    if metadata["word"]:
        if value is None and option.default is None:
            return None
        if isinstance(value, str) and value == metadata["word"]:
            return option.default if option.default is None else value
        value = _number(value)
    kind = numbers.Integral if option.type is int else numbers.Real
    low, high = metadata["limits"]
    if isinstance(value, bool) or not isinstance(value, kind) or not low <= value <= high:
        what = "a whole number" if option.type is int else "a number"
        word = f", or {metadata['word']!r}" if metadata["word"] else ""
        raise SettingsError(f"{name} is {value!r}; it must be {what} from {low} to {high}{word}")
    return int(value) if option.type is int else float(value)


def _number(value):
    """The number that a text spells; anything else as it is."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value
