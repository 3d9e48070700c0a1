"""Scenes made in Blender by script. Each function returns nothing: it leaves the current scene as it is to be rendered.

Materials and lamps are such as map exactly, unless a scene is there to show what doesn't."""

import math

import bpy
import numpy
from mathutils import Vector

WIDTH, HEIGHT = 96, 64


def clear(bounces=3):
    """An empty scene that Cycles renders without any of its approximations."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    cycles = scene.cycles
    cycles.device, cycles.use_denoising, cycles.use_adaptive_sampling = "CPU", False, False
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 1.5
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces"):
        setattr(cycles, name, bounces)
    cycles.transparent_max_bounces = 32
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.world = world
    return scene


def add(data, name, location=(0, 0, 0), towards=None, rotation=None, scale=None):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    thing.location = location
    if towards is not None:
        thing.rotation_euler = (Vector(towards) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    if rotation is not None:
        thing.rotation_euler = rotation
    if scale is not None:
        thing.scale = scale
    return thing


def camera(location, towards, lens=35):
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    bpy.context.scene.camera = add(data, "Camera", location, towards)
    return bpy.context.scene.camera


def lamp(kind, energy, location, towards=None, colour=(1, 1, 1), **settings):
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy, data.color = energy, colour
    for name, value in settings.items():
        setattr(data, name, value)
    return add(data, data.name, location, towards)


def material(name, node_type, **inputs):
    """One shader node, linked to the surface."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output, shader = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new(node_type)
    for key, value in inputs.items():
        target = shader.inputs.get(key.replace("_", " "))
        if target:
            target.default_value = value
        else:
            setattr(shader, key, value)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def diffuse(name, r, g, b):
    return material(name, "ShaderNodeBsdfDiffuse", Color=(r, g, b, 1))


def volume(tree, node_type, **inputs):
    """A volume node, linked to the output of a material's or the world's tree."""
    shader = tree.nodes.new(node_type)
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(shader.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    return shader


def mesh(name, vertices, faces, made_of, smooth=False):
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    if made_of:
        data.materials.append(made_of)
    for polygon in data.polygons:
        polygon.use_smooth = smooth
    data.update()
    return data


def box(name, made_of):
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return mesh(name, corners, [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
                made_of)


def sheet(name, made_of, size=1.0):
    data = mesh(name, [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)], [(0, 1, 2, 3)], made_of)
    layer = data.uv_layers.new(name="UVMap")
    for loop, uv in zip(layer.data, ((0, 0), (1, 0), (1, 1), (0, 1))):
        loop.uv = uv
    return data


def ball(name, made_of, segments=32):
    import bmesh
    data = bpy.data.meshes.new(name)
    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=1, calc_uvs=True)
    shape.to_mesh(data)
    shape.free()
    data.materials.append(made_of)
    for polygon in data.polygons:
        polygon.use_smooth = True
    return data


def picture(name, width, height, function, is_float=False):
    """A packed picture whose pixel (i, j), from the bottom left, is function(i, j)."""
    image = bpy.data.images.new(name, width, height, float_buffer=is_float, is_data=is_float)
    values = numpy.ones((height, width, 4), dtype=numpy.float32)
    for j in range(height):
        for i in range(width):
            values[j, i, :3] = function(i, j)
    image.pixels.foreach_set(values.ravel())
    image.update()
    return image


# ---- the scenes ------------------------------------------------------------------------------------------------------


def spot_in_fog():
    """A spot with Blender's soft edge in the world's fog, on a wall and a floor."""
    scene = clear(bounces=3)
    volume(scene.world.node_tree, "ShaderNodeVolumeScatter", Color=(0.9, 0.9, 0.9, 1), Density=0.08, Anisotropy=0.3)
    camera((0, -7, 1.6), (0, 0, 1.4), lens=30)
    grey = diffuse("grey", 0.5, 0.4, 0.3)
    add(sheet("floor", grey, 8), "floor")
    add(sheet("wall", grey, 8), "wall", (0, 5, 0), rotation=(math.pi / 2, 0, 0))
    lamp("SPOT", 900, (-3, 0.5, 3), (1.2, 0, 0.6), (1, 0.8, 0.6), spot_size=math.radians(34), spot_blend=0.6,
         shadow_soft_size=0)
    add(box("block", grey), "block", (0.8, 0.3, 0.5), scale=(0.4, 0.4, 0.5), rotation=(0, 0, 0.5))


def volume_box():
    """Fog of g = 0.5 in a box, coloured, in a room with an area light and a ball-shaped lamp."""
    scene = clear(bounces=4)
    camera((0, -5.5, 1.5), (0, 0, 1.2), lens=32)
    white, red = diffuse("white", 0.7, 0.7, 0.7), diffuse("red", 0.6, 0.15, 0.1)
    add(sheet("floor", white, 3), "floor")
    add(sheet("ceiling", white, 3), "ceiling", (0, 0, 3.2))
    add(sheet("back", white, 3), "back", (0, 2.5, 1), rotation=(math.pi / 2, 0, 0))
    add(sheet("left", red, 3), "left", (-2.4, 0, 1), rotation=(0, math.pi / 2, 0))
    lamp("AREA", 60, (0.9, -0.4, 2.9), (0, 0, 0), (1, 0.95, 0.9), shape="RECTANGLE", size=0.9, size_y=0.5)
    lamp("POINT", 25, (-1.5, -0.6, 2.2), None, (0.5, 0.7, 1), shadow_soft_size=0.15)
    fog = bpy.data.materials.new("fog")
    fog.use_nodes = True
    fog.node_tree.nodes.clear()
    fog.node_tree.nodes.new("ShaderNodeOutputMaterial")
    volume(fog.node_tree, "ShaderNodeVolumePrincipled", Color=(0.8, 0.6, 0.4, 1), Density=1.2, Anisotropy=0.5,
           Absorption_Color=(0.2, 0.1, 0.05, 1))
    add(box("fog", fog), "fog", (0.2, 0.4, 0.9), scale=(0.9, 0.7, 0.7), rotation=(0, 0, 0.4))


def sun_and_sky():
    """A sun, an environment map turned by a node, a textured sheet, a glass ball, rough metal, a lens."""
    scene = clear(bounces=6)
    tree = scene.world.node_tree
    sky = picture("sky", 64, 32, lambda i, j: (0.2 + 0.6 * (i / 64), 0.3 + 0.02 * j, 0.9 - 0.5 * i / 64)
                  if j > 12 else (0.15, 0.1, 0.05), is_float=True)
    environment, mapping = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    environment.image = sky
    mapping.inputs["Rotation"].default_value = (0.2, 0, 0.9)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], environment.inputs["Vector"])
    tree.links.new(environment.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.8
    lamp("SUN", 2.5, (0, 0, 5), (1.5, 2, 1), (1, 0.9, 0.7), angle=0)
    eye = camera((0, -6, 2), (0, 0, 0.8), lens=40)
    eye.data.dof.use_dof, eye.data.dof.focus_distance, eye.data.dof.aperture_fstop = True, 6, 0.4
    eye.data.shift_x, eye.data.shift_y = 6 / WIDTH, -3 / WIDTH
    textured = material("textured", "ShaderNodeBsdfDiffuse")
    nodes, links = textured.node_tree.nodes, textured.node_tree.links
    texture, turn, uv = (nodes.new(kind) for kind in
                         ("ShaderNodeTexImage", "ShaderNodeMapping", "ShaderNodeTexCoord"))
    texture.interpolation = "Closest"  # where the two interpolate, they differ
    texture.image = picture("tiles", 64, 64, lambda i, j: (0.15 + 0.7 * (i > 40), 0.2 + 0.6 * (j > 24), 0.3))
    turn.inputs["Rotation"].default_value = (0, 0, 0.4)
    turn.inputs["Scale"].default_value = (2, 1.5, 1)
    turn.inputs["Location"].default_value = (0.1, 0.3, 0)
    links.new(uv.outputs["UV"], turn.inputs["Vector"])
    links.new(turn.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Diffuse BSDF"].inputs["Color"])
    add(sheet("floor", textured, 4), "floor")
    glass = material("glass", "ShaderNodeBsdfGlass", Color=(0.9, 1, 0.95, 1), IOR=1.45, Roughness=0.0)
    add(ball("glass", glass), "glass", (-0.9, 0, 0.9), scale=(0.8, 0.8, 0.8))
    metal = material("metal", "ShaderNodeBsdfAnisotropic", Color=(0.9, 0.6, 0.3, 1), Roughness=0.45, distribution="GGX")
    add(ball("metal", metal), "metal", (1.1, 0.6, 0.7), scale=(0.7, 0.7, 0.7))


def instances():
    """A collection placed three times, once mirrored, with a modifier whose levels differ for render and view; an
    emitting sheet, which shines to both sides; a portrait picture."""
    scene = clear(bounces=3)
    scene.render.resolution_x, scene.render.resolution_y = HEIGHT, WIDTH
    camera((0, -8, 2.2), (0, 0, 1.5), lens=40)
    add(sheet("floor", diffuse("floor", 0.6, 0.6, 0.6), 6), "floor")
    add(sheet("wall", diffuse("wall", 0.4, 0.5, 0.6), 6), "wall", (0, 3, 0), rotation=(math.pi / 2, 0, 0))
    blue = diffuse("blue", 0.2, 0.3, 0.8)
    wedge = mesh("wedge", [(-0.6, -0.4, 0), (0.6, -0.4, 0), (0.6, 0.4, 0), (-0.6, 0.4, 0), (-0.6, 0, 1.4)],
                 [(3, 2, 1, 0), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)], blue)
    group = bpy.data.collections.new("group")
    part = bpy.data.objects.new("wedge", wedge)
    group.objects.link(part)
    lump = bpy.data.objects.new("lump", box("lump", diffuse("green", 0.2, 0.6, 0.2)))
    lump.location, lump.scale = (0.7, -0.5, 0.3), (0.3, 0.3, 0.3)
    rounded = lump.modifiers.new("Subdivision", "SUBSURF")
    rounded.levels, rounded.render_levels = 0, 2
    group.objects.link(lump)
    for i, (place, size) in enumerate((((-1.2, 0, 0), (1, 1, 1)), ((1.2, 0.5, 0), (-1, 1, 1.3)),
                                       ((0, 1, 1.8), (0.8, 0.8, 0.8)))):
        empty = add(None, "instance %d" % i, place, scale=size, rotation=(0, 0, 0.5 * i))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    glow = material("glow", "ShaderNodeEmission", Color=(1, 0.8, 0.5, 1), Strength=6)
    add(sheet("glow", glow, 0.5), "glow", (-0.6, 0.5, 3), rotation=(0.5, 1.2, 0))
    lamp("POINT", 120, (1.5, -2, 3.5), shadow_soft_size=0)


def nested():
    """A denser box of fog in the world's fog, lit from within by a point lamp and by a hard-edged spot; the camera
    stands in a third volume; a glowing one."""
    scene = clear(bounces=2)
    volume(scene.world.node_tree, "ShaderNodeVolumePrincipled", Color=(0.7, 0.7, 0.7, 1), Density=0.06)
    camera((0, -6, 1.5), (0, 0, 1.3), lens=32)
    grey = diffuse("grey", 0.5, 0.5, 0.5)
    add(sheet("floor", grey, 8), "floor", (0, 0, -0.5))
    add(sheet("wall", grey, 8), "wall", (0, 4, 0), rotation=(math.pi / 2, 0, 0))
    for name, node, inputs, place, size in (
            ("dense", "ShaderNodeVolumeScatter", dict(Color=(0.5, 0.7, 0.9, 1), Density=0.5), (0.6, 0.5, 1), (1, 1, 1)),
            ("about the eye", "ShaderNodeVolumeAbsorption", dict(Color=(0.9, 0.6, 0.5, 1), Density=0.4), (0, -6, 1.5),
             (0.7, 0.9, 0.7)),
            ("glowing", "ShaderNodeVolumePrincipled", dict(Color=(0.3, 0.3, 0.3, 1), Density=0.3,
                                                           Emission_Strength=0.15, Emission_Color=(1, 0.3, 0.1, 1)),
             (-1.7, 1, 1.2), (0.5, 0.5, 0.9))):
        fog = bpy.data.materials.new(name)
        fog.use_nodes = True
        fog.node_tree.nodes.clear()
        fog.node_tree.nodes.new("ShaderNodeOutputMaterial")
        volume(fog.node_tree, node, **inputs)
        add(box(name, fog), name, place, scale=size)
    lamp("POINT", 60, (0.7, 0.4, 1.1), None, (1, 0.9, 0.8), shadow_soft_size=0)
    lamp("SPOT", 500, (-2.5, -1, 3), (0, 0.5, 0.6), spot_size=math.radians(24), spot_blend=0, shadow_soft_size=0)


# Name: what builds it, samples per pixel of Cycles and of ours, for each seed.
COMPARED = {"spot_in_fog": (spot_in_fog, 96, 16), "volume_box": (volume_box, 48, 16),
            "sun_and_sky": (sun_and_sky, 32, 32), "instances": (instances, 32, 16), "nested": (nested, 160, 64)}
