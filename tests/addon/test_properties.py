"""The sidebar's properties and the operator's arguments are Settings, nothing else and nothing less."""

import pytest


@pytest.fixture
def options(extension):
    return extension("core.settings").options()


def generated(bpy, options):
    scene = bpy.context.scene.vad.bl_rna.properties
    operator = bpy.ops.vad.reconstruct.get_rna_type().properties
    return [(option, group[name]) for name, option in options.items() for group in (scene, operator)]


def test_defaults_limits_and_help_are_those_of_settings(blender, options):
    for option, shown in generated(blender, options):
        metadata = option.metadata
        assert shown.default == (metadata["word"] if option.default is None else option.default)
        assert shown.description.startswith(metadata["help"])
        assert metadata["unit"] in shown.description
        if metadata["choices"]:
            assert tuple(item.identifier for item in shown.enum_items) == metadata["choices"]
            assert [item.description for item in shown.enum_items] == list(metadata["meanings"].values())
        elif metadata["limits"] and not metadata["word"]:
            assert (shown.hard_min, shown.hard_max) == pytest.approx(metadata["limits"], rel=1e-6)


def test_choices_are_spelt_as_people_do(blender):
    shown = [one for one in blender.context.scene.vad.bl_rna.properties if one.type == "ENUM"]
    names = {item.name for one in shown for item in one.enum_items}
    assert {"PCA", "NumPy", "CPU", "CUDA", "Double", "Torch"} <= names
    assert {"Pca", "Numpy", "Cpu", "Cuda"}.isdisjoint(names)


def test_the_operator_has_no_other_arguments_and_forgets_them(blender, options):
    properties = blender.ops.vad.reconstruct.get_rna_type().properties
    assert {prop.identifier for prop in properties} == {*options, "selected_only", "keep_both", "rna_type"}
    assert all(prop.is_skip_save for prop in properties if prop.identifier != "rna_type")


def test_settings_come_from_the_scene_unless_the_operator_says_otherwise(blender, extension):
    properties, settings = extension("vad_addon.properties"), extension("core.settings").Settings

    class Override:
        bridge = 4.5

        def is_property_set(self, name):
            return name == "bridge"

    stored = blender.context.scene.vad
    stored.resolution, stored.bridge, stored.offset = 40, 2.0, 1.1
    assert properties.settings_from(stored, Override()) == settings(resolution=40, bridge=4.5, offset=1.1)


@pytest.mark.parametrize("end", [0, 1])
def test_every_limit_survives_single_precision(blender, extension, options, end):
    stored = blender.context.scene.vad

    class Nothing:
        def is_property_set(self, name):
            return False

    limits = {name: option.metadata["limits"] for name, option in options.items() if not option.metadata["word"]}
    numeric = {name: pair[end] for name, pair in limits.items() if pair}
    stored.band = "8"  # which the finest grids need
    for name, limit in numeric.items():
        setattr(stored, name, limit)
    settings = extension("vad_addon.properties").settings_from(stored, Nothing())
    assert {name: getattr(settings, name) for name in numeric} == numeric


def test_a_number_or_a_word_is_typed_as_text(blender, extension, options):
    stored = blender.context.scene.vad
    settings_from = extension("vad_addon.properties").settings_from

    class Nothing:
        def is_property_set(self, name):
            return False

    assert settings_from(stored, Nothing()).denoise == "auto"
    stored.denoise = "0.25"
    assert settings_from(stored, Nothing()).denoise == 0.25
    stored.denoise = "much"
    with pytest.raises(extension("core.errors").SettingsError, match="denoise is 'much'"):
        settings_from(stored, Nothing())
