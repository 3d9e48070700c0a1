"""A scene full of what doesn't map, and what is to be said of it: once each."""

import math

import bpy

import scenes

# A part of the line that must be there exactly once.
EXPECTED = [
    "scene Scene: limits for diffuse, glossy bounces aren't there",
    "scene Scene: what trades truth for less noise isn't there (sample clamp indirect 10, blur glossy 1)",
    "scene Scene: motion blur isn't there",
    "camera Camera: its aperture isn't round",
    "camera Camera: shift x is 3.2500 pixels",
    "light Spot: a spot has no extent, and this one has a radius of 0.1",
    "light Spot: its falloff is exported as linear in the angle",
    "light Sun: a sun has no extent, and this one has 0.526 degrees",
    "light Sun: the world's volume lies between it and everything",
    "light Area: its light spreads over 90 degrees only",
    "light Area: there is no ellipse",
    "light Point: its nodes are more than one Emission",
    "light Point: it stands in fog",
    "world World, node Noise: is no background that is exported",
    "material plastic, node Principled BSDF: the specular layer over the diffuse one isn't exported",
    "material plastic, node Principled BSDF: Coat Weight is 0.5 and isn't exported",
    "material frosted, node Glass BSDF: Roughness comes from the node Noise Texture",
    "material frosted, node Glass BSDF: there is no rough glass",
    "material half, node Mix Shader: a mixture of diffuse and dielectric isn't there",
    "material half, node Image Texture: has no picture",
    "material toon, node Toon BSDF: there is nothing like it",
    "material bumpy, node Diffuse BSDF: its normal comes from the node Bump",
    "volume of crossing: scatters with g = 0 and 0.9 in one place",
    "material smoke, node Principled Volume: Density comes from the node Noise Texture",
    "material smoke, node Principled Volume: blackbody emission isn't exported",
    "object open fog: its mesh isn't closed",
    "volumes of open fog and crossing: they overlap in part",
    "object hidden: it is hidden from camera rays",
    "object cloud: a volume isn't exported",
    "material droplets, node Volume Scatter: there is no phase function mie",
]


def _linked(made, kind, source, target):
    node = made.node_tree.nodes.new(kind)
    shader = next(n for n in made.node_tree.nodes if n.inputs.get(target) and n.type != "OUTPUT_MATERIAL"
                  and n is not node)
    made.node_tree.links.new(node.outputs[source], shader.inputs[target])
    return node


def _fog(name, node, **inputs):
    fog = bpy.data.materials.new(name)
    fog.use_nodes = True
    fog.node_tree.nodes.clear()
    fog.node_tree.nodes.new("ShaderNodeOutputMaterial")
    scenes.volume(fog.node_tree, node, **inputs)
    return fog


def _lights_and_world(scene):
    cycles = scene.cycles
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 12, 4, 4
    cycles.transmission_bounces = cycles.volume_bounces = 12
    cycles.sample_clamp_indirect, cycles.blur_glossy = 10, 1
    scene.render.use_motion_blur = True
    eye = scenes.camera((0, -6, 2), (0, 0, 1))
    eye.data.shift_x = 3.25 / scenes.WIDTH
    eye.data.dof.use_dof, eye.data.dof.aperture_blades = True, 6
    scenes.lamp("SPOT", 100, (0, 0, 4), (0, 0, 0), spot_size=math.radians(170), spot_blend=0.5, shadow_soft_size=0.1)
    scenes.lamp("SUN", 1, (0, 0, 4), (1, 0, 0), angle=0.00918)
    scenes.lamp("AREA", 10, (1, 0, 4), (0, 0, 0), spread=math.pi / 2, shape="ELLIPSE", size=1, size_y=0.5)
    point = scenes.lamp("POINT", 10, (2, 0, 3), shadow_soft_size=0.1)
    point.data.use_nodes = True
    tree = point.data.node_tree
    mix = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(tree.nodes["Emission"].outputs[0], mix.inputs[0])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    world = scene.world.node_tree
    noise = world.nodes.new("ShaderNodeTexNoise")
    noise.name = "Noise"
    world.links.new(noise.outputs["Color"], world.get_output_node("CYCLES").inputs["Surface"])
    scenes.volume(world, "ShaderNodeVolumeScatter", Density=0.02)


def build():
    scene = scenes.clear()
    _lights_and_world(scene)
    plastic = scenes.material("plastic", "ShaderNodeBsdfPrincipled", Coat_Weight=0.5)
    frosted = scenes.material("frosted", "ShaderNodeBsdfGlass", Roughness=0.3)
    _linked(frosted, "ShaderNodeTexNoise", "Fac", "Roughness")
    half = scenes.material("half", "ShaderNodeMixShader", Fac=0.4)
    tree = half.node_tree
    for i, kind in enumerate(("ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlass")):
        tree.links.new(tree.nodes.new(kind).outputs[0], tree.nodes["Mix Shader"].inputs[1 + i])
    tree.links.new(tree.nodes.new("ShaderNodeTexImage").outputs["Color"], tree.nodes["Diffuse BSDF"].inputs["Color"])
    bumpy = scenes.diffuse("bumpy", 0.5, 0.5, 0.5)
    _linked(bumpy, "ShaderNodeBump", "Normal", "Normal")
    smoke = _fog("smoke", "ShaderNodeVolumePrincipled", Blackbody_Intensity=1.0)
    _linked(smoke, "ShaderNodeTexNoise", "Fac", "Density")
    droplets = _fog("droplets", "ShaderNodeVolumeScatter", Density=0.3)
    next(n for n in droplets.node_tree.nodes if n.type == "VOLUME_SCATTER").phase = "MIE"
    made = [plastic, frosted, half, scenes.material("toon", "ShaderNodeBsdfToon"), bumpy]
    for i, each in enumerate(made):
        scenes.add(scenes.box(each.name, each), each.name, (2.5 * i - 5, 3, 1))
    opened = scenes.box("open fog", smoke)
    opened.clear_geometry()
    opened.from_pydata([(-1, -1, -1), (1, -1, -1), (0, 1, -1), (0, 0, 1)], [], [(0, 1, 3), (1, 2, 3), (2, 0, 3)])
    scenes.add(opened, "open fog", (0, 0, 1))
    scenes.add(scenes.box("crossing", droplets), "crossing", (0.5, 0, 0.8))
    hidden = scenes.add(scenes.box("hidden", None), "hidden", (5, 0, 0))
    hidden.visible_camera = False
    scenes.add(bpy.data.volumes.new("cloud"), "cloud")
