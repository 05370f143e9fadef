"""How the volume and its slices look, at every scale."""

import bpy

CELL = "vad_cell"  # custom property of a volume: the grid spacing that its densities are made for
SIZE = "vad_size"  # and the size of its box, (3,)
_FOG = "vad_fog"  # custom property that tells our materials from the user's
_OPACITY = 1.5  # optical depth per cell where the fog is densest, in renders; it fades out over two cells
_NEAR_AND_FAR = (1.0, 0.45, 0.03, 1.0), (0.01, 0.05, 0.45, 1.0)
_LINE, _SURFACE = (0.01, 0.01, 0.03, 1.0), (1.0, 1.0, 1.0, 1.0)
_LINE_EVERY, _LINE_WIDTH = 2.0, 0.25  # cells
_DISPLAY = 0.5  # the same in the viewport's solid view


def fit_fog(volume: bpy.types.Volume, cell: float, shape: tuple[int, int, int]) -> None:
    """Make the fog of `volume` suit grid cells of this size, in renders and in the viewport.

    A volume seen for the first time gets a material. Later only its densities follow the cell, so that whatever the
    user changed stays.
    """
    if CELL not in volume:
        volume.materials.append(_fog_material(volume.name, cell))
        volume.display.density = _DISPLAY / cell
    else:
        ratio = volume[CELL] / cell
        volume.display.density *= ratio
        for material in volume.materials:
            if material is not None and _FOG in material:
                for node in _principled(material):
                    node.inputs["Density"].default_value *= ratio
    volume[CELL], volume[SIZE] = cell, [cell * (nodes - 1) for nodes in shape]


def _fog_material(name, cell):
    material, nodes, links = _blank(name)
    material[_FOG] = True
    volume, output = nodes.new("ShaderNodeVolumePrincipled"), nodes.new("ShaderNodeOutputMaterial")
    volume.inputs["Color"].default_value = 0.35, 0.65, 1.0, 1.0
    volume.inputs["Density"].default_value = _OPACITY / cell
    output.location.x = 300
    links.new(volume.outputs["Volume"], output.inputs["Volume"])
    return material


def iso_lines(name: str, cell: float, far: float) -> bpy.types.Material:
    """A material that emits a colour for the attribute `distance`, from 0 to `far`, with a dark line every two cells
    and the surface itself in white; by the attribute `slope` lines are as wide where the distance grows slowly."""
    material, nodes, links = _blank(name)

    def node(kind):
        made = nodes.new(kind)
        made.location.x = 200 * len(nodes)
        return made

    def attribute(name):
        made = node("ShaderNodeAttribute")
        made.attribute_name = name
        return made.outputs["Fac"]

    def math(operation, *inputs):
        made = node("ShaderNodeMath")
        made.operation = operation
        for socket, given in zip(made.inputs, inputs, strict=False):
            if isinstance(given, bpy.types.NodeSocket):
                links.new(given, socket)
            else:
                socket.default_value = given
        return made.outputs[0]

    def painted(colour, over, where):
        made = node("ShaderNodeMixRGB")
        made.inputs[2].default_value = colour
        links.new(where, made.inputs[0])
        links.new(over, made.inputs[1])
        return made.outputs[0]

    distance, slope, ramp = attribute("distance"), attribute("slope"), node("ShaderNodeValToRGB")
    for element, colour in zip(ramp.color_ramp.elements, _NEAR_AND_FAR, strict=True):
        element.color = colour
    links.new(math("DIVIDE", distance, far), ramp.inputs["Fac"])
    line = math("FRACT", math("ADD", math("DIVIDE", distance, _LINE_EVERY * cell), 0.5))  # 0.5 where a line is
    off = math("ABSOLUTE", math("SUBTRACT", line, 0.5))
    line = math("LESS_THAN", off, math("MULTIPLY", math("MINIMUM", slope, 1.0), 0.5 * _LINE_WIDTH / _LINE_EVERY))
    colour = painted(_LINE, over=ramp.outputs["Color"], where=line)
    colour = painted(_SURFACE, over=colour, where=math("LESS_THAN", distance, 0.6 * cell))
    emission, output = node("ShaderNodeEmission"), node("ShaderNodeOutputMaterial")
    links.new(colour, emission.inputs["Color"])
    links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def carried_colours(name: str, attribute: str) -> bpy.types.Material:
    """A plain surface in the colours that the points carry in `attribute`."""
    material, nodes, links = _blank(name)
    colour, surface, output = (
        nodes.new(kind) for kind in ("ShaderNodeAttribute", "ShaderNodeBsdfPrincipled", "ShaderNodeOutputMaterial")
    )
    for place, node in enumerate((colour, surface, output)):
        node.location.x = 300 * place
    colour.attribute_name = attribute
    links.new(colour.outputs["Color"], surface.inputs["Base Color"])
    links.new(surface.outputs[0], output.inputs["Surface"])
    return material


def _blank(name):
    """A new material, its nodes, of which there are none yet, and its links."""
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # before Blender 5.0
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree.nodes, material.node_tree.links


def _principled(material):
    return [node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeVolumePrincipled"]
