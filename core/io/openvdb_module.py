"""Where the OpenVDB Python module comes from."""

import importlib.machinery
import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType

from ..errors import MissingDependency

_REMEDY = "run inside Blender 4.5 or newer, or `pip install bpy`, which carries it"

_SITE_PACKAGES = "*/python/lib/python3.*/site-packages", "*/python/lib/site-packages"  # the second is Windows


@cache
def load_openvdb() -> ModuleType:
    """The `openvdb` module: Blender's own, an installed one, or the one inside the `bpy` wheel (bpy stays unimported).

    Raises :class:`MissingDependency` where there is none.
    """
    try:
        import openvdb
    except ModuleNotFoundError:
        return _load_from_bpy_wheel()
    return openvdb


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
