"""Blender's view of :class:`core.Settings`: properties generated from it, and the way back."""

import bpy

from ..core.settings import Settings, default_in_words, options
from .overlay import VAD_PG_overlay

_SPELT = {"pca": "PCA", "numpy": "NumPy", "cpu": "CPU", "cuda": "CUDA"}  # choices that are no words

RUN_OPTIONS = {
    "selected_only": bpy.props.BoolProperty(
        name="Selected Points Only",
        description="Of objects in edit mode, use only the points selected there",
        options={"SKIP_SAVE"},
    ),
    "keep_both": bpy.props.BoolProperty(
        name="Keep Earlier Results",
        description="Put the results beside those of an earlier run on the same object, rather than in their place",
        options={"SKIP_SAVE"},
    ),
}


def settings_properties(**keywords) -> dict:
    """Name -> deferred bpy property of every setting; `keywords` go to each property, e.g. ``options={"SKIP_SAVE"}``.

    Meant as a class's ``__annotations__``.
    """
    return {name: setting_property(option, **keywords) for name, option in options().items()}


def taken_over(stored, properties, names) -> dict:
    """The values of an operator's `properties` of these names; what was not set takes the value that `stored` holds, so
    that the redo panel starts from what is."""
    for name in names:
        if not properties.is_property_set(name):
            setattr(properties, name, getattr(stored, name))
    return {name: getattr(properties, name) for name in names}


def settings_from(stored, override=None, **given) -> Settings:
    """Settings held by `stored` (a :class:`VAD_PG_scene`), except those that were set explicitly in `override`
    (an operator's ``properties``) and those `given`. Raises :class:`SettingsError`."""
    return Settings(**{name: _exact(value) for name, value in (_merged(options(), stored, override) | given).items()})


def chosen(stored, override=None) -> dict[str, bool]:
    """The options of a run that are no settings of the method, by the same rule."""
    return _merged(RUN_OPTIONS, stored, override)


def _merged(names, stored, override):
    def holder(name):
        return override if override is not None and override.is_property_set(name) else stored

    return {name: getattr(holder(name), name) for name in names}


def setting_property(option, **keywords):
    """The deferred bpy property that shows this field of Settings."""
    metadata = option.metadata
    unit = f". Unit: {metadata['unit']}" if metadata["unit"] else ""
    keywords |= dict(
        name=option.name.replace("_", " ").title(),
        description=metadata["help"] + unit,
        default=default_in_words(option),
    )
    if metadata["choices"]:
        items = [(one, _SPELT.get(one, one.title()), meaning) for one, meaning in metadata["meanings"].items()]
        return bpy.props.EnumProperty(items=items, **keywords)
    if metadata["word"]:  # a number or the word: Settings takes numbers as text, too
        words = [metadata["word"]]
        return bpy.props.StringProperty(search=lambda self, context, text: words, **keywords)
    if option.type is bool:
        return bpy.props.BoolProperty(**keywords)
    low, high = metadata["limits"]
    kind = {int: bpy.props.IntProperty, float: bpy.props.FloatProperty}[option.type]
    return kind(min=low, max=high, **keywords)


def _exact(value):
    """Blender keeps single precision, which would turn 0.1 into 0.10000000149 and a limit into a value beyond it."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


_STATE = {
    "result": bpy.props.PointerProperty(
        type=bpy.types.Collection, name="Last Result", description="Collection made by the last run"
    ),
    "overlay": bpy.props.PointerProperty(type=VAD_PG_overlay),
}


class VAD_PG_scene(bpy.types.PropertyGroup):
    """What the sidebar keeps with each scene: the settings, the collection of the last run, the look of the normals."""

    __annotations__ = settings_properties() | RUN_OPTIONS | _STATE
