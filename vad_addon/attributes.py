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
}

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


def read(data) -> dict[str, Attribute]:
    """Every attribute that each point of `data` carries, by name, its position and Blender's internal ones left out."""
    return {
        attribute.name: Attribute(attribute.data_type, values(attribute))
        for attribute in data.attributes
        if attribute.domain == "POINT"
        and attribute.data_type in _LAYOUT
        and attribute.name != "position"
        and not attribute.name.startswith(".")
    }


def write(data, attributes: dict[str, Attribute]) -> None:
    """Set these attributes on the points of `data`, replacing those of the same name. Those that points cannot have in
    Blender, as `material_index`, get `scan_` before their name, and long names are cut off."""
    for name, attribute in attributes.items():
        name = name.encode()[:_LONGEST].decode(errors="ignore")
        if name in data.attributes and data.attributes[name].data_type != attribute.kind:
            data.attributes.remove(data.attributes[name])
        target = (
            data.attributes.get(name)
            or data.attributes.new(name, attribute.kind, "POINT")
            or data.attributes.new(f"scan_{name}", attribute.kind, "POINT")
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
    """Attributes of parts laid end to end, each given as (number of points, attributes). Where a part lacks one, or
    holds it with another type than the first part that has it, its points get zeros."""
    kinds = {}
    for _, attributes in parts:
        for name, attribute in attributes.items():
            kinds.setdefault(name, attribute.kind)

    def of_part(name, kind, count, attributes):
        found = attributes.get(name)
        if found is not None and found.kind == kind:
            return found.values
        _, width, dtype = _LAYOUT[kind]
        return np.zeros((count, width) if width > 1 else count, dtype)

    return {
        name: Attribute(kind, np.concatenate([of_part(name, kind, *part) for part in parts]))
        for name, kind in kinds.items()
    }


def values(attribute: bpy.types.Attribute) -> np.ndarray:
    """Those of all elements, (n,) or (n,width)."""
    name, width, dtype = _LAYOUT[attribute.data_type]
    found = np.empty((len(attribute.data), width), dtype)
    attribute.data.foreach_get(name, found.ravel())
    return found if width > 1 else found[:, 0]
