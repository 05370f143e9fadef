"""Points from text: tables of numbers and Wavefront OBJ."""

import csv
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain, islice
from pathlib import Path
from typing import TextIO

import numpy as np

from ..errors import InputError
from .columns import COLOURS, XYZ, are_colours, named_columns, unnamed_columns, with_colours_in_bytes
from .not_a_number import spelt_plainly

_COMMENT = re.compile(r"(?:^|(?<=[\s\d.,;]))(?:#|//)(?![,;\t])")  # not the mark in a name, as in "Point#,X,Y,Z"
_UNIT = re.compile(r"\([^)]*\)|\[[^]]*\]")  # as in "X (m)"
_SEPARATOR = re.compile(r"\W?sep=.\W?", re.IGNORECASE)  # a line for spreadsheets
_CELL = re.compile(r'"[^"]*"|\S+')  # between blanks
_MARKS = "\t", ";", ",", None  # that part cells; None stands for any run of blanks


def read_text(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(n,3) float64 from a table, see :func:`core.io.points.read_points` for what it may look like, and its further
    columns by name, (n,) each, those that have a number in each row."""
    try:
        points, attributes, _ = _read(path)
    except InputError:
        points, _, further = _read(path, ())
        attributes = _readable(path, further)
    return points, with_colours_in_bytes(attributes)


def _readable(path, names):
    """Those of the columns of some names that have a number in each row, looked for in ever smaller halves."""
    with suppress(InputError):
        return _read(path, names)[1] if names else {}
    middle = len(names) // 2
    return _readable(path, names[:middle]) | _readable(path, names[middle:]) if middle else {}


def read_obj(path: Path) -> np.ndarray:
    """(n,3) float64 from the v lines of a Wavefront OBJ file."""
    with _open(path) as file:
        lines = _Lines(file)
        vertices = (line[2:] for line in map(str.lstrip, lines) if line.startswith(("v ", "v\t")))
        return _table(path, lines, vertices, None, (0, 1, 2))


def obj_faces(path: Path) -> list[np.ndarray]:
    """The vertices around each face of a Wavefront OBJ file, (k,) int64 each. Raises :class:`ValueError` for faces that
    are not sound."""
    faces, count = [], 0
    with _open(path) as file:
        for kind, *corners in map(str.split, _Lines(file)):
            count += kind == "v"
            if kind == "f":
                number = np.array([int(corner.partition("/")[0]) for corner in corners], np.int64)
                faces.append(np.where(number < 0, number + count, number - 1))  # those below 0 count from the last one
    return faces


class _Lines:
    """The lines that hold more than blanks and comments, without these and what ends them; remembers the last one
    handed out, and the last comment on a line of its own."""

    def __init__(self, file: TextIO):
        self._file = file
        self.number = 0
        self.text = ""
        self.comment = ""

    def __iter__(self) -> Iterator[str]:
        for number, text in enumerate(self._file, start=1):
            self.number, self.text = number, text
            text, comment = spelt_plainly(text), []
            if "#" in text or "//" in text:
                text, *comment = _COMMENT.split(text, maxsplit=1)
            text = text.rstrip(" \r\n")
            if text.strip():
                yield text
            elif comment:
                self.comment = comment[0]


def _read(path, wanted=None):
    """The points, further columns by name, those `wanted` or all, and the names of all that there are."""
    with _open(path) as file:
        lines, claimed, header = _Lines(file), [], None
        rows = iter(lines)
        first = next(rows, "")
        if _SEPARATOR.fullmatch(first.strip()):
            first = next(rows, "")
        if _is_count(first):
            claimed.append(int(first))
            rows = _rows_of_blocks(rows, claimed)
            first = next(rows, "")
        elif not any(map(_is_number, _cells(first, _mark_in(first)))):
            header, first = first, next(rows, "")
        elif _is_numbering(first):
            numbering, first = first, next(rows, "")
            if all(cell.isdecimal() for cell in _cells(first, _mark_in(first))):  # whole numbers all over: a point
                first, rows = numbering, chain([first], rows)
        columns, named, mark = _columns(path, header, lines.comment, first)
        further = list(columns)[3:]
        guessed = not named and further == list(COLOURS)
        columns = {name: c for name, c in columns.items() if name in XYZ or wanted is None or name in wanted}
        if mark != "," and _has_decimal_commas(first):
            first, rows = _with_points(first), map(_with_points, rows)
        table = _table(path, lines, chain([first] if first else [], rows), mark, tuple(columns.values()))
    if claimed and sum(claimed) != len(table):
        where = "in its first line" if len(claimed) == 1 else f"in {len(claimed)} blocks"
        advice = "is it cut off?" if len(table) < sum(claimed) else "correct that number, or leave out such lines"
        raise InputError(f"{path} says {sum(claimed)} points {where}, but {len(table)} follow; {advice}")
    attributes = dict(zip(list(columns)[3:], table.T[3:], strict=True))
    if guessed and not (attributes and are_colours(table[:, 3:])):
        attributes, further = {}, []
    return table[:, :3], attributes, further


def _columns(path, header, comment, first):
    """The columns of numbers, by name: x, y and z, then those with one in the first row; whether the names are the
    file's; and what parts its cells. A comment before it that names as many as there are is a header, as other programs
    write it."""
    heading = _UNIT.sub("", comment if header is None else header)
    between_names, mark = (_mark_in(heading), _mark_in(first)) if header is None else _marks_in(heading, first)
    names, values = _cells(heading, between_names), _cells(first, mark)
    named = header is not None or (len(names) == len(values) and XYZ.keys() <= {name.lower() for name in names})
    if header is not None:
        names = _in_place(names, values, header, first)
    columns = named_columns(path, names) if named else unnamed_columns(path, values)
    shifted = len(names) > len(values) > 0 and max(columns[axis] for axis in XYZ) > 2
    if named and shifted and mark is None:
        raise InputError(
            f"{path} names {len(names)} columns ({' '.join(names[:8])}), but has {len(values)}; give names without "
            "blanks, or part them by commas"
        )
    kept = {name: c for name, c in columns.items() if name in XYZ or (c < len(values) and _is_number(values[c]))}
    return kept, named, mark


def _in_place(names, values, header, first):
    """The names of a header, each over its column: row names have none as R writes them, in quotes, and as pandas does,
    whole numbers beside a header that starts with blanks; and what marks it as a comment stands over none."""
    if len(names) == len(values) + 1 and names[0] in {"#", "//"}:
        return names[1:]
    if len(values) != len(names) + 1:
        return names
    quoted = first.startswith('"') and first.count('"') == 2
    numbered = header.startswith(" ") and not first.startswith(" ") and values[0].isdecimal()
    return ["", *names] if quoted or numbered else names


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
        return np.empty((0, len(columns)))
    rows = chain([first], rows)
    how = dict(delimiter=delimiter, usecols=columns, comments=None, ndmin=2)
    if delimiter is not None or '"' in first:
        how["quotechar"], rows = '"', map(_closed, rows)
    try:
        return np.loadtxt(rows, **how)
    except ValueError as error:  # loadtxt takes one row at a time: the last one is the culprit
        seen = lines.text.strip()
        seen = seen if len(seen) <= 60 else seen[:60] + "..."
        raise InputError(
            f"{path}: line {lines.number} is {seen!r}; numbers x y z are expected in "
            f"columns {', '.join(str(column + 1) for column in columns[:3])}"
        ) from error


def _closed(row):
    """A row without its quotes where one is not closed: rows up to the next would be lost in it."""
    return row if row.count('"') % 2 == 0 else row.replace('"', "")


def _marks_in(header, first):
    """What parts the cells of a header and of the first row: the same, where that gives as many of each, else whatever
    seems to part either."""
    for mark in _MARKS:
        names, values = _cells(header, mark), _cells(first, mark)
        if len(names) == len(values) >= 3 or len(_to_last(names)) == len(_to_last(values)) >= 3:
            return mark, mark
    return _mark_in(header), _mark_in(first)


def _to_last(cells):
    """Without the empty ones at the end."""
    return cells[: max((i for i, cell in enumerate(cells, start=1) if cell), default=0)]


def _mark_in(row):
    """What seems to part the cells of a row by itself; tabs part columns that may hold blanks."""
    row = _with_points(row) if _has_decimal_commas(row) else row
    if mark := next((mark for mark in ";," if mark in row), None):
        return mark
    cells = row.strip().split("\t")
    return "\t" if len(cells) >= 3 and all(cell.strip() for cell in cells) else None


def _has_decimal_commas(row):
    """Whether something else than commas parts its cells: semicolons, or blanks and tabs between whole numbers and
    such with a comma inside."""
    if ";" in row:
        return True
    cells = row.split()
    return len(cells) >= 3 and all(cell.strip(",") == cell and _is_number(_with_points(cell)) for cell in cells)


def _with_points(row):
    return row.replace(",", ".")


def _cells(row, mark):
    """What is in the cells of a row, decimal commas as points."""
    if mark != "," and _has_decimal_commas(row):
        row = _with_points(row)
    if mark is None:
        return [cell.strip('"') for cell in _CELL.findall(row)]
    cells = row.split(mark)
    if '"' in row:
        with suppress(csv.Error):  # a cell that is endless
            cells = next(csv.reader([row], delimiter=mark, skipinitialspace=True))
    return [cell.strip().strip('"') for cell in cells]


def _is_count(line):
    return (line := line.strip()).isdecimal() and len(line) < 19


def _is_numbering(line):
    """Whether a line counts columns from 0 on, not between blanks, as tables without names are written."""
    mark = _mark_in(line)
    cells = [] if mark is None else _cells(line, mark)
    return len(cells) >= 3 and cells == list(map(str, range(len(cells))))


def _is_number(token):
    try:
        float(token)
    except ValueError:
        return False
    return True
