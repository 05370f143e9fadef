"""Points from text: tables of numbers and Wavefront OBJ."""

import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import TextIO

import numpy as np

from ..errors import InputError

_COMMA = re.compile(r"\d,\d")
_UNIT = re.compile(r"\([^)]*\)|\[[^]]*\]")  # as in "X (m)"


def read_text(path: Path) -> np.ndarray:
    """(n,3) float64 from a table; see :func:`core.io.points.read_points` for what it may look like."""
    with _open(path) as file:
        lines = _Lines(file)
        rows = iter(lines)
        first = next(rows, "")
        claimed, columns = [], (0, 1, 2)
        if _is_count(first):
            claimed.append(int(first))
            rows = _rows_of_blocks(rows, claimed)
            first = next(rows, "")
        elif not any(map(_is_number, _split(first))):
            columns, first = _named_columns(path, first), next(rows, "")
        points = _table(path, lines, chain([first] if first else [], rows), _delimiter(first), columns)
    if claimed and sum(claimed) != len(points):
        where = "in its first line" if len(claimed) == 1 else f"in {len(claimed)} blocks"
        raise InputError(f"{path} says {sum(claimed)} points {where}, but {len(points)} follow; is it cut off?")
    return points


def read_obj(path: Path) -> np.ndarray:
    """(n,3) float64 from the v lines of a Wavefront OBJ file."""
    with _open(path) as file:
        lines = _Lines(file)
        return _table(path, lines, (line[2:] for line in lines if line.startswith(("v ", "v\t"))), None, (0, 1, 2))


class _Lines:
    """The lines that hold more than blanks and comments, stripped of both; remembers the last one handed out."""

    def __init__(self, file: TextIO):
        self._file = file
        self.number = 0
        self.text = ""

    def __iter__(self) -> Iterator[str]:
        for number, text in enumerate(self._file, start=1):
            self.number, self.text = number, text
            if "#" in text:
                text = text.partition("#")[0]
            if "//" in text:
                text = text.partition("//")[0]
            text = text.strip()
            if text:
                yield text


def _rows_of_blocks(rows, claimed):
    """The rows of blocks, as scanners write several views, each under a line that says how many it has; adds those
    numbers to `claimed`, which holds the first."""
    while True:
        yield from islice(rows, claimed[-1])
        following = next(rows, "")
        if not _is_count(following):
            break
        claimed.append(int(following))
    if following:
        yield from chain([following], rows)


def _open(path):
    """Numbers are ASCII; what else stands in comments and further columns must not matter. With the mark of UTF-16, as
    spreadsheets write it, the text is that."""
    with open(path, "rb") as file:
        wide = file.read(2) in (BOM_UTF16_LE, BOM_UTF16_BE)
    return open(path, encoding="utf-16" if wide else "utf-8-sig", errors="replace")


def _table(path, lines: _Lines, rows: Iterable[str], delimiter, columns):
    first = next(rows := iter(rows), None)
    if first is None:
        return np.empty((0, 3))
    try:
        return np.loadtxt(chain([first], rows), delimiter=delimiter, usecols=columns, comments=None, ndmin=2)
    except ValueError as error:  # loadtxt takes one row at a time: the last one is the culprit
        seen = lines.text.strip()
        remedy = "; write decimals with a point" if _COMMA.search(seen) and delimiter != "," else ""
        seen = seen if len(seen) <= 60 else seen[:60] + "..."
        raise InputError(
            f"{path}: line {lines.number} is {seen!r}; numbers x y z are expected in "
            f"columns {', '.join(str(column + 1) for column in columns)}{remedy}"
        ) from error


def _delimiter(row):
    """None stands for any run of blanks; tabs part columns that may hold blanks."""
    if mark := next((mark for mark in ";," if mark in row), None):
        return mark
    cells = row.split("\t")
    return "\t" if len(cells) >= 3 and all(cell.strip() for cell in cells) else None


def _split(row):
    return [token.strip() for token in row.split(_delimiter(row))]


def _named_columns(path, header):
    """Where a line of names puts x, y and z, with units or not; three columns of other names are taken for them."""
    names = [name.strip('" ').lower() for name in _split(_UNIT.sub("", header))]
    if set("xyz") <= set(names):
        return tuple(map(names.index, "xyz"))
    if len(names) > 3:
        seen = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
        raise InputError(f"{path} has {len(names)} columns, named {seen}; name those of the coordinates x, y and z")
    return 0, 1, 2


def _is_count(line):
    return line.isdecimal() and len(line) < 19


def _is_number(token):
    try:
        float(token)
    except ValueError:
        return False
    return True
