"""LuxCore (PyPI pyluxcore): PATHCPU with Sobol' points, no clamping. A mode is its light strategy, as log_power. Its
spots radiate I / cos: they get the flux of the scene's."""

import os
import time

# It crashes where an OpenCL driver is found; nothing here renders with one.
os.environ["OCL_ICD_VENDORS"] = "/nonexistent"

import numpy

import scene_numbers
import worker

state = {}


def load(path, mode, parameters):
    import pyluxcore
    pyluxcore.Init(lambda message: None)
    numbers = scene_numbers.read(path, parameters)
    scene = pyluxcore.Scene()
    props = {"scene.camera.type": "perspective", "scene.camera.fieldofview": float(numbers.fov),
             "scene.camera.lookat.orig": numbers.origin, "scene.camera.lookat.target": numbers.target,
             "scene.camera.up": numbers.up}
    if numbers.medium:
        sigma_t, albedo, g = numbers.medium
        props.update({"scene.volumes.fog.type": "homogeneous", "scene.volumes.fog.ior": 1.0,
                      "scene.volumes.fog.absorption": [sigma_t * (1 - albedo)] * 3,
                      "scene.volumes.fog.scattering": [sigma_t * albedo] * 3,
                      "scene.volumes.fog.asymmetry": [g] * 3, "scene.volumes.fog.multiscattering": numbers.depth > 2,
                      "scene.world.volume.default": "fog"})
    for i, mesh in enumerate(numbers.meshes):
        name = "mesh%d" % i
        scene.DefineMesh(name, [tuple(map(float, p)) for p in mesh.points],
                         [tuple(map(int, t)) for t in mesh.triangles], None, None, None, None)
        material = {"type": "matte", "kd": mesh.reflectance}
        if mesh.radiance is not None:
            material.update({"emission": mesh.radiance, "emission.theta": 90.0})
        props.update({"scene.materials.%s.%s" % (name, key): value for key, value in material.items()})
        props.update({"scene.objects.%s.shape" % name: name, "scene.objects.%s.material" % name: name})
    for i, spot in enumerate(numbers.spots):
        cos = numpy.cos(numpy.radians(spot.cutoff))
        lamp = {"type": "spot", "position": spot.position, "target": spot.target,
                "coneangle": float(spot.cutoff), "conedeltaangle": 0.001, "power": 0.0, "efficency": 0.0,
                "gain": spot.intensity * ((1 - cos) / -numpy.log(cos))}
        props.update({"scene.lights.spot%d.%s" % (i, key): value for key, value in lamp.items()})
    scene.Parse(properties(pyluxcore, props))
    state.update(pyluxcore=pyluxcore, scene=scene, numbers=numbers, mode=mode)
    return pyluxcore.Version()


def properties(pyluxcore, values):
    result = pyluxcore.Properties()
    for key, value in values.items():
        if isinstance(value, (list, numpy.ndarray)):
            value = [float(x) for x in value]  # it doesn't know numpy's
        result.Set(pyluxcore.Property(key, value))
    return result


def render(spp, seed):
    pyluxcore, numbers = state["pyluxcore"], state["numbers"]
    # Light scattered once is its depth 1, n times n + 1, the last of which lacks what only MIS would have found.
    depth = numbers.depth if numbers.depth > 2 else 1
    config = pyluxcore.RenderConfig(properties(pyluxcore, {
        "renderengine.type": "PATHCPU", "renderengine.seed": seed + 1, "sampler.type": "SOBOL",
        "sampler.sobol.adaptive.strength": 0.0, "native.threads.count": len(os.sched_getaffinity(0)),
        "film.width": numbers.width, "film.height": numbers.height, "film.filter.type": "BOX",
        "film.filter.width": 0.5, "film.filter.xwidth": 0.5, "film.filter.ywidth": 0.5,
        "path.pathdepth.total": depth, "path.pathdepth.diffuse": depth, "path.pathdepth.glossy": depth,
        "path.pathdepth.specular": depth, "path.clamping.variance.maxvalue": 0.0,
        "path.hybridbackforward.enable": False,
        "lightstrategy.type": state["mode"].upper(), "batch.haltspp": spp}), state["scene"])
    session = pyluxcore.RenderSession(config)
    session.Start()
    while not session.HasDone():
        time.sleep(0.002)
        session.UpdateStats()
    session.Stop()
    session.UpdateStats()
    done = session.GetStats().Get("stats.renderengine.pass").GetInt()
    picture = numpy.empty(numbers.width * numbers.height * 3, dtype=numpy.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, picture)
    return picture.reshape(numbers.height, numbers.width, 3)[::-1], done


worker.serve(load, render)
