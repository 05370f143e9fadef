"""Values that points carry: read from Blender's geometry, joined, picked and written back."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..core.io.columns import COLOURS

_LAYOUT = {  # attribute type -> name of the value, width, NumPy type
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "INT8": ("value", 1, np.int32),
    "INT16_2D": ("value", 2, np.int32),
    "INT32_2D": ("value", 2, np.int32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
}
_COLOURS = {"FLOAT_COLOR", "BYTE_COLOR"}
_WIDER = {  # attribute type -> those of which it holds the values
    "FLOAT_COLOR": _COLOURS,
    "INT": {"INT", "INT8", "BOOLEAN"},
    "FLOAT": {"FLOAT", "INT", "INT8", "BOOLEAN"},
}
_BLENDERS = {  # names by which it shades, creases, bevels and draws a mesh: there numbers of a scan do harm, or fail
    *("custom_normal", "material_index", "sharp_face", "sharp_edge", "crease_vert", "crease_edge"),
    *("bevel_weight_vert", "bevel_weight_edge", "uv_seam", "freestyle_edge", "freestyle_face"),
}
_OTHERS = "scan_"

_LONGEST = 62  # bytes of a name; there may be 67, with what may be put before it


@dataclass(frozen=True)
class Attribute:
    """`kind` is Blender's `data_type`; values are (n,) or (n,width)."""

    kind: str
    values: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray) -> "Attribute":
        """(n,) or (n,3) real numbers in single precision."""
        return cls("FLOAT" if values.ndim == 1 else "FLOAT_VECTOR", np.asarray(values, np.float32))

    def __getitem__(self, rows) -> "Attribute":
        return Attribute(self.kind, self.values[rows])

    @property
    def is_colour(self) -> bool:
        return self.kind in _COLOURS


def read(data) -> dict[str, Attribute]:
    """Every attribute that each point of `data` carries, by name, its position, the size that it is drawn at and
    Blender's internal ones left out. Colours of a mesh's corners are averaged at its points."""
    found = {
        attribute.name: Attribute(attribute.data_type, values(attribute))
        for attribute in _own(data)
        if attribute.domain == "POINT" and attribute.data_type in _LAYOUT
    }
    for attribute in filter(_is_of_corners, _own(data)):
        found[attribute.name] = Attribute(attribute.data_type, _at_points(data, values(attribute)))
    return found


def left_out(data) -> list[str]:
    """Names of what :func:`read` leaves out, for its kind or as it is of faces or edges of a mesh; no UV maps, which
    suit no other faces."""
    return [
        attribute.name
        for attribute in _own(data)
        if not _is_of_corners(attribute)
        and (attribute.domain, attribute.data_type) != ("CORNER", "FLOAT2")
        and (attribute.data_type not in _LAYOUT or attribute.domain != "POINT")
        and not (attribute.domain != "POINT" and attribute.name in _BLENDERS)
    ]


def _own(data):
    drawn = {"position"} if isinstance(data, bpy.types.Mesh) else {"position", "radius"}
    return [one for one in data.attributes if one.name not in drawn and not one.name.startswith(".")]


def _is_of_corners(attribute):
    """Whether these are colours of corners, of which a mesh without faces has none."""
    return attribute.domain == "CORNER" and attribute.data_type in _COLOURS and len(attribute.data) > 0


def _at_points(mesh, of_corners):
    """Means at the points, (n,width) float32, of values (c,width) of the corners of faces; zeros at loose points."""
    points, count = np.empty(len(mesh.loops), np.int32), len(mesh.vertices)
    mesh.loops.foreach_get("vertex_index", points)
    sums = np.stack([np.bincount(points, column, count) for column in of_corners.T], axis=1)
    return (sums / np.maximum(np.bincount(points, minlength=count), 1)[:, None]).astype(np.float32)


def renamed(attributes: dict[str, Attribute], taken=()) -> dict[str, Attribute]:
    """The same under names that are free and short enough: those that are `taken`, or that Blender goes by, get `scan_`
    put before, long ones are cut off, and then those that are alike numbered."""
    free = {}
    for name, attribute in attributes.items():
        while name in free or name in taken or name in _BLENDERS:
            name = _OTHERS + name
        endings = ("", *(f"_{number}" for number in range(2, 2 + len(free))))
        free[next(short for short in (_cut(name, ending) for ending in endings) if short not in free)] = attribute
    return free


def _cut(name, ending):
    return name.encode()[: _LONGEST - len(ending)].decode(errors="ignore") + ending


def write(data, attributes: dict[str, Attribute]) -> None:
    """Set these attributes on the points of `data`, replacing those of the same name, see :func:`renamed`. Those that
    points cannot have there get `scan_` before their name, too."""
    for name, attribute in renamed(attributes).items():
        if name in data.attributes and data.attributes[name].data_type != attribute.kind:
            data.attributes.remove(data.attributes[name])
        target = (
            data.attributes.get(name)
            or data.attributes.new(name, attribute.kind, "POINT")
            or data.attributes.new(_OTHERS + name, attribute.kind, "POINT")
        )
        target.data.foreach_set(_LAYOUT[attribute.kind][0], np.ascontiguousarray(attribute.values).ravel())


def of_file(carried: dict[str, np.ndarray]) -> dict[str, Attribute]:
    """What the points of a file carry, by name, (n,) each; red, green and blue up to 255 as one colour, named `Col` as
    by Blender's importer of .ply files."""
    colours = [carried[name] for name in COLOURS if name in carried and carried[name].dtype == np.uint8]
    if len(colours) < len(COLOURS):
        return {name: Attribute.of(values) for name, values in carried.items()}
    shown = np.stack(colours, axis=1) / 255
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1 (sRGB)
    opaque = np.append(linear, np.ones((len(shown), 1)), axis=1)
    rest = {name: Attribute.of(values) for name, values in carried.items() if name not in COLOURS}
    return {"Col": Attribute("BYTE_COLOR", opaque.astype(np.float32)), **rest}


def join(parts: list[tuple[int, dict[str, Attribute]]]) -> dict[str, Attribute]:
    """Attributes of parts laid end to end, each given as (number of points, attributes). Where a part lacks one its
    points get zeros. Colours of two types, or numbers, become ones of the type that holds both; what parts hold with
    other types of one name is left out."""
    held = {}
    for attributes in (found for count, found in parts if count):
        for name, attribute in attributes.items():
            held.setdefault(name, set()).add(attribute.kind)
    kinds = {name: kind for name, those in held.items() if (kind := _holding_all(those)) is not None}

    def of_part(name, kind, count, attributes):
        _, width, dtype = _LAYOUT[kind]
        if count and name in attributes:
            return attributes[name].values.astype(dtype)
        return np.zeros((count, width) if width > 1 else count, dtype)

    return {
        name: Attribute(kind, np.concatenate([of_part(name, kind, *part) for part in parts]))
        for name, kind in kinds.items()
    }


def _holding_all(kinds):
    """The type of attribute that holds what those of some `kinds` do; None where there is none."""
    if len(kinds) == 1:
        return next(iter(kinds))
    return next((wider for wider, others in _WIDER.items() if kinds <= others), None)


def values(attribute: bpy.types.Attribute) -> np.ndarray:
    """Those of all elements, (n,) or (n,width)."""
    name, width, dtype = _LAYOUT[attribute.data_type]
    found = np.empty((len(attribute.data), width), dtype)
    attribute.data.foreach_get(name, found.ravel())
    return found if width > 1 else found[:, 0]
