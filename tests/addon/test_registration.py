"""Registering is reversible, and says what to do where SciPy is missing."""

import sys
import types

import pytest


def shown(bpy):
    names = {name for name in dir(bpy.types) if name.startswith("VAD_")}
    return names | ({"Scene.vad"} if hasattr(bpy.types.Scene, "vad") else set())


def test_registering_twice_leaves_nothing_behind(empty, extension):
    vad_addon = extension("vad_addon")
    assert shown(empty) == set()
    for _ in range(2):
        vad_addon.register()
        assert {"Scene.vad", "VAD_PT_reconstruct", "VAD_OT_reconstruct"} <= shown(empty)
        vad_addon.unregister()
        assert shown(empty) == set()


def test_it_can_be_disabled_where_a_script_cleared_the_handlers(empty, extension):
    vad_addon, before = extension("vad_addon"), len(empty.app.handlers.load_post)
    for _ in range(2):
        vad_addon.register()
        for handlers in (empty.app.handlers.load_post, empty.app.handlers.depsgraph_update_post):
            handlers.clear()
        vad_addon.unregister()
        assert not hasattr(empty.types.Scene, "vad")
    assert len(empty.app.handlers.load_post) <= before


def test_every_operator_and_every_choice_says_what_it_does(blender, extension):
    shown = [cls for cls in extension("vad_addon.interface").CLASSES if not issubclass(cls, blender.types.Panel)]
    operators = [cls for cls in shown if issubclass(cls, blender.types.Operator)]
    assert len(operators) > 12
    for cls in operators:
        rna = getattr(blender.ops.vad, cls.bl_idname.partition(".")[2]).get_rna_type()
        assert len(rna.description) > 20, cls
        for choice in rna.properties:
            assert choice.description or choice.is_hidden or choice.identifier == "rna_type", (cls, choice)
    stored = blender.context.scene.vad
    for group in (stored, stored.overlay):
        for choice in group.bl_rna.properties:
            assert choice.description or choice.identifier in {"rna_type", "name", "overlay"}, (group, choice)


@pytest.fixture
def without_scipy(monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "scipy", None)


def test_without_scipy_the_tab_and_the_operator_say_what_to_do(empty, extension, without_scipy):
    vad_addon = extension("vad_addon")
    vad_addon.register()
    try:
        assert "Install the VAD zip" in " ".join(drawn(empty, extension, "VAD_PT_reconstruct", "unavailable").texts)
        with pytest.raises(RuntimeError, match=r"SciPy does not import.*pip install scipy"):
            empty.ops.vad.reconstruct(resolution=64)
    finally:
        vad_addon.unregister()
    assert shown(empty) == set()


class Layout:
    """Stands in for Blender's layout, which needs a window: keeps the texts and the properties shown."""

    def __init__(self):
        self.texts, self.props, self.operators = [], [], []

    def column(self, align=False):
        return self

    row = column

    def label(self, text="", icon="NONE"):
        self.texts.append(text)

    def prop(self, data, name, text=""):
        assert name in data.bl_rna.properties
        self.props.append(name)

    def operator(self, name, icon="NONE", text="", depress=False):
        self.operators.append(name)
        self.texts += [f"[{text}]" if depress else text] if text else []
        return types.SimpleNamespace()


def drawn(bpy, extension, name, module="panel"):
    panel = getattr(extension(f"vad_addon.{module}"), name)

    class Shown:
        layout = Layout()
        problem = getattr(panel, "problem", "")

    panel.draw(Shown, bpy.context)
    return Shown.layout


def test_the_tab_shows_every_setting_once(blender, extension):
    panels = [drawn(blender, extension, name) for name in ("VAD_PT_reconstruct", "VAD_PT_more_settings")]
    assert panels[0].props == ["resolution", "bridge", "offset"]
    assert sorted(panels[0].props + panels[1].props) == sorted(extension("core.settings").options())
    assert panels[0].operators == ["vad.reconstruct", "vad.denoise", "vad.normals", "vad.estimate"]


def test_the_tab_names_what_is_selected(blender, extension, add, add_mesh):
    def text():
        lines = drawn(blender, extension, "VAD_PT_reconstruct").texts
        assert max(map(len, lines)) <= 36
        return " ".join(lines)

    assert text() == "No active object: select a point cloud or a mesh"
    add("Eye", blender.data.cameras.new("Eye"))
    assert text() == "Eye (camera) holds no points: select a point cloud or a mesh"
    add_mesh("Scan", [(0, 0, 0)] * 1234)
    assert text() == "Scan: 1,234 points"


def test_the_tab_sums_up_the_last_run_with_its_warnings(blender, extension):
    panel = extension("vad_addon.panel").VAD_PT_last_run
    assert not panel.poll(blender.context)
    blender.context.scene.vad.result = blender.data.collections.new("Scan VAD")
    blender.context.scene.vad.result["vad_summary"] = "500 samples\n1.5 s"
    blender.context.scene.vad.result["vad_warnings"] = "a long tale of things that went wrong on the way\nand more"
    assert panel.poll(blender.context)
    assert drawn(blender, extension, "VAD_PT_last_run").texts == [
        "Scan VAD",
        "500 samples",
        "1.5 s",
        "A long tale of things that went",
        "wrong on the way",
        "And more",
    ]


def test_the_tab_shows_and_hides_what_there_is(blender, extension, add_mesh, sphere):
    add_mesh("Scan", sphere)
    assert not extension("vad_addon.panel").VAD_PT_look.poll(blender.context)
    blender.ops.vad.reconstruct(resolution=16)
    layout = drawn(blender, extension, "VAD_PT_look")
    assert layout.texts == ["Scan VAD", "[Surface]", "Field", "Points", "[Scan]"]
    assert layout.operators[:5] == ["vad.show"] * 4 + ["vad.reextract"]


def test_the_tab_is_about_what_is_active(blender, extension, add, add_mesh, sphere):
    panels = "VAD_PT_last_run", "VAD_PT_look"

    def told():
        assert all(getattr(extension("vad_addon.panel"), name).poll(blender.context) for name in panels)
        (name,) = {drawn(blender, extension, name).texts[0] for name in panels}
        return name

    scans = [add_mesh(name, sphere) for name in ("First", "Second", "Third")]
    for scan in scans:
        scan.select_set(False)
    for scan in scans[:2]:
        blender.context.view_layer.objects.active = scan
        blender.ops.vad.reconstruct(resolution=16)
    for active in ("First", "First field", "First surface"):
        blender.context.view_layer.objects.active = blender.data.objects[active]
        assert told() == "First VAD"
    blender.context.view_layer.objects.active = scans[2]
    assert not any(getattr(extension("vad_addon.panel"), name).poll(blender.context) for name in panels)
    for operator in (blender.ops.vad.reextract, blender.ops.vad.shell):
        with pytest.raises(RuntimeError, match="Third has no results yet: reconstruct it first, or select results"):
            operator()
    for scan in scans[1:]:
        scan.select_set(True)
    blender.ops.vad.reconstruct(resolution=16)
    scans[1].select_set(False)
    assert told() == "Third VAD"
    add("Eye", blender.data.cameras.new("Eye"))
    assert told() == "Third VAD"


def test_every_panel_draws_before_and_after_a_run_and_while_axes_are_fixed(blender, extension, add_mesh, sphere):
    def shown():
        panels = extension("vad_addon.panel").CLASSES
        names = [cls.__name__ for cls in panels if not hasattr(cls, "poll") or cls.poll(blender.context)]
        return {name: drawn(blender, extension, name).operators for name in names}

    assert not {"VAD_PT_look", "VAD_PT_last_run", "VAD_PT_axes"} & set(shown())
    add_mesh("Scan", sphere)
    blender.ops.vad.reconstruct(resolution=16)
    blender.ops.vad.shell()
    assert {"VAD_PT_look", "VAD_PT_last_run"} <= set(shown())
    blender.context.view_layer.objects.active = blender.data.objects["Scan"]
    blender.ops.object.mode_set(mode="EDIT")
    assert shown()["VAD_PT_axes"] == ["vad.fix_axes"] * 4 + ["vad.free_axes"]
    blender.ops.object.mode_set(mode="OBJECT")
