"""Points from PLY files, by way of plyfile."""

import io
import re
import warnings
from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement, PlyListProperty, PlyParseError, PlyProperty

from ..errors import InputError
from .columns import not_among
from .not_a_number import spelt_plainly

_FIRST_LINE = re.compile(rb"(?:" + BOM_UTF8 + rb")?ply[ \t]*(\r\n|\n|\r)", re.IGNORECASE)
_IGNORED = re.compile(rb"((comment|obj_info)\b.*)?", re.DOTALL)
_AROUND = {"vertex_indices", "vertex_index"}  # of faces
_NO_ASCII = re.compile(r"[^!-~]+")
_ELEMENT = re.compile(rb"^(element[ \t]+\S+)[ \t]+(-?\d+)$", re.MULTILINE)


def read_ply(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """x, y, z of the vertices, (n,3) float64, and what else they have one number of, by name, (n,) as stored."""
    try:
        return _read(path.read_bytes())
    except (PlyParseError, ValueError, OverflowError) as error:
        raise InputError(f"{path} is not a sound PLY file: {error}") from error


def ply_faces(path: Path) -> list[np.ndarray]:
    """The vertices around each face, (k,) each. Raises :class:`ValueError` for faces that are not sound."""
    content = path.read_bytes()
    layout, counts, start = _header(content)
    names = [element.name for element in layout]
    if "face" not in names:
        return []
    last = names.index("face")
    around = {p.name for p in layout.elements[last].properties if isinstance(p, PlyListProperty)} & _AROUND
    if not around:
        return []
    try:
        return list(_read_rows(layout.elements[: last + 1], counts, layout, content[start:])[0][around.pop()])
    except PlyParseError as error:
        raise ValueError(str(error)) from error


def _read(content):
    layout, counts, start = _header(content)
    names = [element.name for element in layout]
    if "vertex" not in names:
        raise ValueError(f"it has no element 'vertex', only {names}")
    last = names.index("vertex")
    vertex = layout.elements[last]
    scalars = {p.name for p in vertex.properties if not isinstance(p, PlyListProperty)}
    axes = [next((name for name in (axis, axis.upper()) if name in scalars), None) for axis in "xyz"]
    if None in axes:
        raise ValueError(f"its vertices have the numbers {sorted(scalars)}; x, y and z are needed")

    rows = [_smallest_row(element, layout) for element in layout]
    needed, held = sum(n * size for n, size in zip(counts, rows, strict=True)) - layout.text, len(content) - start
    if needed > held:
        raise ValueError(
            f"its header claims {counts[last]} vertices and with all else at least {needed} bytes, "
            f"but {held} follow; is it cut off?"
        )

    through_vertex = layout.elements[: last + 1]
    if not layout.text and not any(isinstance(p, PlyListProperty) for e in through_vertex for p in e.properties):
        offset = start + sum(n * size for n, size in zip(counts[:last], rows, strict=False))
        vertices = np.frombuffer(content, vertex.dtype(layout.byte_order), counts[last], offset)
        rest = content[offset + vertices.nbytes :] if last == len(names) - 1 else b""
    else:
        vertices, rest = _read_rows(through_vertex, counts, layout, content[start:])
    if last == len(names) - 1 and rest.strip():
        raise ValueError(f"its header claims {counts[last]} vertices, but more data follows them")
    points = np.stack([vertices[axis].astype(np.float64) for axis in axes], axis=1)
    further = (p for p in vertex.properties if p.name in scalars - set(axes))
    return points, {p.name: _as_declared(vertices[p.name], p.dtype()) for p in further}


def _as_declared(values, kind):
    """The values in the type that the header declares, where that holds them all."""
    with np.errstate(over="ignore", invalid="ignore"):
        found = values.astype(kind)
    held = np.isfinite(found) == np.isfinite(values) if found.dtype.kind == "f" else found == values
    return found if held.all() else values


def _header(content):
    """What the header declares (elements without rows), their row counts, and where the data start.

    plyfile reads the header with every count set to zero, so that nothing is allocated before the counts are checked,
    and without comments, which may be in any encoding, blank lines and blanks at the ends of lines. What is no ASCII in
    names becomes `_`, and a number tells names apart that are alike by that.
    """
    first = _FIRST_LINE.match(content)
    if not first:
        raise ValueError(f"it starts with {content[:16]!r}, not with a line 'ply'")
    newline = first[1]
    last = re.search(newline + rb"[ \t]*end_header[ \t]*" + newline, content)
    if not last:
        raise ValueError("its header has no line 'end_header'; is it cut off?")
    lines = [line.strip() for line in content[first.end() : last.end()].split(newline)]
    lines = _in_ascii([b"ply", *(line for line in lines if not _IGNORED.fullmatch(line))])
    header = b"".join(line + b"\n" for line in lines)
    counts = []

    def without_rows(match):
        counts.append(int(match[2]))
        return match[1] + b" 0"

    layout = PlyData.read(io.BytesIO(_ELEMENT.sub(without_rows, header)))
    if len(counts) != len(layout) or min(counts, default=0) < 0:
        raise ValueError("an element of its header has no valid count")
    return layout, counts, last.end()


def _in_ascii(lines):
    taken = {line.split()[-1].decode() for line in lines if line.isascii() and line}
    for line in lines:
        if not line.isascii():
            *kind, name = line.split()
            name = not_among(taken, _NO_ASCII.sub("_", name.decode(errors="replace")))
            taken.add(name)
            line = b" ".join([*kind, name.encode()])
        yield line


def _smallest_row(element, layout):
    """Bytes that a row takes at least; exact for binary rows without lists."""
    if layout.text:
        return 2 * len(element.properties)
    return sum(
        np.dtype(p.list_dtype()[0] if isinstance(p, PlyListProperty) else p.dtype()).itemsize
        for p in element.properties
    )


def _in_double(found):
    return found if isinstance(found, PlyListProperty) else PlyProperty(found.name, "f8")


def _read_rows(elements, counts, layout, body):
    """The rows of the last of `elements` and the bytes or text after them, by plyfile, row by row; it warns of lists
    that are empty in text. Numbers in text are read in double precision: that is what digits may be of, and some hold
    what the header's type does not."""
    properties = [[_in_double(p) if layout.text else p for p in e.properties] for e in elements]
    elements = [PlyElement(e.name, held, n) for e, held, n in zip(elements, properties, counts, strict=False)]
    header = PlyData(elements, layout.text, layout.byte_order).header
    if layout.text:
        lines = spelt_plainly(body.decode("ascii", errors="replace")).splitlines()
        stream = io.StringIO("\n".join([header, *filter(str.strip, lines), ""]))
    else:
        stream = io.BytesIO(header.encode("ascii") + b"\n" + body)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "loadtxt: input contained no data", UserWarning)
        return PlyData.read(stream)[elements[-1].name].data, stream.read()
