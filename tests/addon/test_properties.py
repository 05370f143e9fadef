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
        assert shown.default == option.default
        assert shown.description.startswith(metadata["help"])
        assert metadata["unit"] in shown.description
        if metadata["choices"]:
            assert tuple(item.identifier for item in shown.enum_items) == metadata["choices"]
        else:
            assert (shown.hard_min, shown.hard_max) == pytest.approx(metadata["limits"], rel=1e-6)


def test_the_operator_has_no_other_arguments_and_forgets_them(blender, options):
    properties = blender.ops.vad.reconstruct.get_rna_type().properties
    assert {prop.identifier for prop in properties} == {*options, "rna_type"}
    assert all(properties[name].is_skip_save for name in options)


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

    numeric = {name: option.metadata["limits"][end] for name, option in options.items() if option.metadata["limits"]}
    for name, limit in numeric.items():
        setattr(stored, name, limit)
    settings = extension("vad_addon.properties").settings_from(stored, Nothing())
    assert {name: getattr(settings, name) for name in numeric} == numeric
