"""Where the OpenVDB Python module comes from."""

import importlib.machinery
import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

from ..errors import MissingDependency
from ..field.blocks import SIDE, Blocks

_REMEDY = "run inside Blender 4.5 or newer, or `pip install bpy`, which carries it"

_SITE_PACKAGES = "*/python/lib/python3.*/site-packages", "*/python/lib/site-packages"  # the second is Windows


@cache
def load_openvdb() -> ModuleType:
    """The `openvdb` module: Blender's own, an installed one, or the one inside the `bpy` wheel (bpy stays unimported).

    Raises :class:`MissingDependency` where there is none.
    """
    try:
        import openvdb
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError) and error.name == "openvdb":
            return _load_from_bpy_wheel()
        raise MissingDependency(f"OpenVDB does not load ({error}); install it anew, or {_REMEDY}") from error
    return openvdb


def fill(grid, values: np.ndarray | Blocks) -> None:
    """Fill a grid. Of the constant blocks of :class:`Blocks` the negative ones become tiles, the others background."""
    if isinstance(values, np.ndarray):
        grid.copyFromArray(values)
        return
    shape = np.array(values.shape)
    for corner, block in zip(values.corners().tolist(), values.stored, strict=True):
        grid.copyFromArray(block, tuple(corner))
    constant = (values.slot < 0) & (values.outer < 0)
    for i, j in zip(*np.nonzero(constant.any(axis=2)), strict=True):
        edge = np.flatnonzero(np.diff(constant[i, j], prepend=False, append=False))
        for first, end in edge.reshape(-1, 2).tolist():
            high = np.minimum((SIDE * (i + 1), SIDE * (j + 1), SIDE * end), shape) - 1
            low = (int(SIDE * i), int(SIDE * j), SIDE * first)
            grid.fill(low, tuple(high.tolist()), values.outer[i, j, first].item(), False)


def _load_from_bpy_wheel():
    bpy = importlib.util.find_spec("bpy")
    folders = [
        str(folder)
        for root in (bpy and bpy.submodule_search_locations) or ()
        for pattern in _SITE_PACKAGES
        for folder in Path(root).glob(pattern)
    ]
    spec = importlib.machinery.PathFinder.find_spec("openvdb", folders)
    if spec is None:
        raise MissingDependency(f"OpenVDB is not installed; {_REMEDY}")
    try:
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError as error:
        raise MissingDependency(f"OpenVDB at {spec.origin} does not load ({error}); {_REMEDY}") from error
    return module
