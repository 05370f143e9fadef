"""What the columns of a table of points hold, by name."""

import re
from itertools import count

import numpy as np

from ..errors import InputError

XYZ = {"x": 0, "y": 1, "z": 2}
COLOURS = "red", "green", "blue"
_COLOUR = dict(zip("rgb", COLOURS, strict=True))
_KNOWN = {*XYZ, *_COLOUR, *COLOURS, "intensity", "nx", "ny", "nz"}
_NO_NAME = re.compile(r"\W+", re.ASCII)  # what names of properties in PLY files may not have
_OF_SCANNERS = {4: ("intensity",), 7: ("intensity", *COLOURS)}


def named_columns(path, names: list[str]) -> dict[str, int]:
    """Where columns of these names are, x, y and z first; three of names that say nothing else are taken for those.
    Columns of one name are numbered from the second on. Raises :class:`InputError` for others without them."""
    columns = {}
    for column, name in enumerate(names):
        columns[not_among(columns, _plain(name) or f"column_{column + 1}")] = column
    if not XYZ.keys() <= columns.keys():
        if len(names) > 3 or columns.keys() & _KNOWN:
            seen = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
            raise InputError(f"{path} has {len(names)} columns, named {seen}; name those of the coordinates x, y and z")
        return XYZ
    if _COLOUR.keys() <= columns.keys() and not columns.keys() & set(COLOURS):
        columns = {_COLOUR.get(name, name): column for name, column in columns.items()}
    return {axis: columns.pop(axis) for axis in XYZ} | columns


def unnamed_columns(path, first: list[str]) -> dict[str, int]:
    """The same where nothing names them, by the cells of the first row: what scanners write to .pts files, colours
    where just the three cells after the coordinates could be bytes, see :func:`are_colours`, else the coordinates."""
    further = _OF_SCANNERS.get(len(first), ()) if path.suffix.lower() == ".pts" else ()
    if not further and [_may_be_byte(cell) for cell in first[3:7]] in ([True] * 3, [True] * 3 + [False]):
        further = COLOURS
    return XYZ | {name: column for column, name in enumerate(further, start=3)}


def _may_be_byte(cell):
    return cell.isdecimal() and len(cell) <= 3 and int(cell) <= 255


def are_colours(values: np.ndarray) -> bool:
    """Whether numbers (n,3) without a name are colours: whole ones from 0 to 255, and not all 0 or 1, as normals of
    walls are."""
    return bool(_are_bytes(values) and (values > 1).any())


def _are_bytes(values):
    return ((values >= 0) & (values <= 255) & (values == np.rint(values))).all()


def with_colours_in_bytes(attributes: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The attributes, colours as uint8 where they are whole numbers from 0 to 255."""
    colours = {name: values for name, values in attributes.items() if name in COLOURS}
    if all(map(_are_bytes, colours.values())):
        attributes = attributes | {name: values.astype(np.uint8) for name, values in colours.items()}
    return attributes


def not_among(taken, name: str) -> str:
    """The name, or the first of name_2, name_3, ... that is not among those taken."""
    tried = (f"{name}_{number}" if number > 1 else name for number in count(1))
    return next(each for each in tried if each not in taken)


def _plain(name):
    name = _NO_NAME.sub("_", name.strip('" ')).strip("_")
    return name.lower() if name.lower() in _KNOWN else name
