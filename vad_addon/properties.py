"""Blender's view of :class:`core.Settings`: properties generated from it, and the way back."""

import bpy

from ..core.settings import Settings, options


def settings_properties(**keywords) -> dict:
    """Name -> deferred bpy property of every setting; `keywords` go to each property, e.g. ``options={"SKIP_SAVE"}``.

    Meant as a class's ``__annotations__``.
    """
    return {name: _property(option, **keywords) for name, option in options().items()}


def settings_from(stored, override) -> Settings:
    """Settings held by `stored` (a :class:`VAD_PG_scene`), except those that were set explicitly in `override`
    (an operator's ``properties``). Raises :class:`SettingsError`."""
    chosen = {name: override if override.is_property_set(name) else stored for name in options()}
    return Settings(**{name: _exact(getattr(source, name)) for name, source in chosen.items()})


def _property(option, **keywords):
    metadata = option.metadata
    unit = f". Unit: {metadata['unit']}" if metadata["unit"] else ""
    keywords |= dict(
        name=option.name.replace("_", " ").title(), description=metadata["help"] + unit, default=option.default
    )
    if metadata["choices"]:
        items = [(choice, choice.title(), "") for choice in metadata["choices"]]
        return bpy.props.EnumProperty(items=items, **keywords)
    low, high = metadata["limits"]
    kind = {int: bpy.props.IntProperty, float: bpy.props.FloatProperty}[option.type]
    return kind(min=low, max=high, **keywords)


def _exact(value):
    """Blender keeps single precision, which would turn 0.1 into 0.10000000149 and a limit into a value beyond it."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


class VAD_PG_scene(bpy.types.PropertyGroup):
    """What the sidebar keeps with each scene: the settings and the collection of the last run."""

    __annotations__ = settings_properties() | {
        "result": bpy.props.PointerProperty(
            type=bpy.types.Collection, name="Last Result", description="Collection made by the last run"
        )
    }
