"""Blender's Cycles (PyPI bpy). A mode is its volume sampling: distance, equiangular or mis; for a scene without fog
"path". Unlike its defaults nothing is clamped, adaptive sampling and denoising are off, every kind of bounce has the
scene's depth, and its data stay in memory between renders."""

import os
import tempfile

import numpy

import scene_numbers
import worker

SAMPLING = {"distance": "DISTANCE", "equiangular": "EQUIANGULAR", "mis": "MULTIPLE_IMPORTANCE"}
state = {}


def load(path, mode, parameters):
    import bpy
    import mathutils
    numbers = scene_numbers.read(path, parameters)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    state.update(bpy=bpy, scene=scene)

    for i, mesh in enumerate(numbers.meshes):
        if mesh.radiance is not None:
            add_panel(bpy, mathutils, scene, mesh)
            continue
        data = bpy.data.meshes.new("mesh%d" % i)
        data.from_pydata([tuple(p) for p in mesh.points], [], [tuple(int(k) for k in t) for t in mesh.triangles])
        data.materials.append(diffuse(bpy, mesh.reflectance))
        scene.collection.objects.link(bpy.data.objects.new(data.name, data))
    for i, spot in enumerate(numbers.spots):
        lamp = bpy.data.lights.new("spot%d" % i, "SPOT")
        strength = max(spot.intensity)
        lamp.energy = 4 * numpy.pi * strength
        lamp.color = tuple(spot.intensity / strength)
        lamp.spot_size = 2 * numpy.radians(spot.cutoff)
        lamp.spot_blend = 0
        lamp.shadow_soft_size = 0
        place(mathutils, scene, bpy.data.objects.new(lamp.name, lamp), spot.position, spot.target,
              numpy.array([0.0, 1.0, 0.0]))
    camera = bpy.data.cameras.new("camera")
    camera.angle = numpy.radians(numbers.fov)
    camera.clip_start = 1e-3
    place(mathutils, scene, bpy.data.objects.new("camera", camera), numbers.origin, numbers.target, numbers.up)
    scene.camera = bpy.data.objects["camera"]
    world = bpy.data.worlds.new("world")
    scene.world = world
    fog(world, numbers.medium, mode)
    settings(scene, numbers)
    return bpy.app.version_string.replace(" ", "")


def place(mathutils, scene, thing, origin, target, up):
    right, top, forward = scene_numbers.frame(origin, target, up)
    matrix = numpy.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, top, -forward, origin
    thing.matrix_world = mathutils.Matrix(matrix.tolist())
    scene.collection.objects.link(thing)


def add_panel(bpy, mathutils, scene, mesh):
    a, b, c, d = mesh.points
    lamp = bpy.data.lights.new("panel", "AREA")
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = numpy.linalg.norm(b - a), numpy.linalg.norm(d - a)
    strength = max(mesh.radiance)
    lamp.energy = numpy.pi * lamp.size * lamp.size_y * strength
    lamp.color = tuple(mesh.radiance / strength)
    centre, normal = (a + c) / 2, numpy.cross(b - a, d - a)
    place(mathutils, scene, bpy.data.objects.new("panel", lamp), centre, centre + normal, (d - a))


def diffuse(bpy, reflectance):
    material = bpy.data.materials.new("diffuse")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    node.inputs["Color"].default_value = (*reflectance, 1)
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def fog(world, medium, mode):
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputWorld")
    if medium is None:
        return
    sigma_t, albedo, g = medium
    node = tree.nodes.new("ShaderNodeVolumeCoefficients")
    node.phase = "HENYEY_GREENSTEIN"
    node.inputs["Absorption Coefficients"].default_value = (sigma_t * (1 - albedo),) * 3
    node.inputs["Scatter Coefficients"].default_value = (sigma_t * albedo,) * 3
    node.inputs["Anisotropy"].default_value = g
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    world.cycles.volume_sampling = SAMPLING[mode]


def settings(scene, numbers):
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = numbers.width, numbers.height
    scene.render.resolution_percentage = 100
    scene.render.threads_mode = "FIXED"
    scene.render.threads = len(os.sched_getaffinity(0))
    scene.render.use_persistent_data = True
    scene.render.use_compositing = scene.render.use_sequencer = False
    image = scene.render.image_settings
    image.file_format, image.color_depth, image.exr_codec, image.color_mode = "OPEN_EXR", "32", "NONE", "RGB"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.use_light_tree = True
    cycles.use_auto_tile = False
    cycles.caustics_reflective = cycles.caustics_refractive = True
    # The first vertex is its bounce 0; it scatters light up to max_bounces + 1 times.
    bounces = numbers.depth - 2
    cycles.max_bounces = cycles.diffuse_bounces = cycles.volume_bounces = bounces
    cycles.glossy_bounces = cycles.transmission_bounces = bounces


def render(spp, seed):
    bpy, scene = state["bpy"], state["scene"]
    scene.cycles.samples, scene.cycles.seed = spp, seed
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = os.path.join(folder, "picture.exr")
        bpy.ops.render.render(write_still=True)
        picture = bpy.data.images.load(scene.render.filepath)
        pixels = numpy.empty(scene.render.resolution_x * scene.render.resolution_y * 4, dtype=numpy.float32)
        picture.pixels.foreach_get(pixels)
        bpy.data.images.remove(picture)
    return pixels.reshape(scene.render.resolution_y, scene.render.resolution_x, 4)[::-1, :, :3], spp


worker.serve(load, render)
