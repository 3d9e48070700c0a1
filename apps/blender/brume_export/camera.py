"""The camera with its film, and the render settings."""

import math

from mathutils import Matrix

from . import elements

# The variance of a Blackman-Harris window of width 1: the four terms of Harris 1978, "On the use of windows", integrated.
BLACKMAN_HARRIS_VARIANCE = 0.0191843


def rigid(matrix):
    """Without scale and shear, as cameras and lamps are used."""
    columns = [matrix.col[i].to_3d().normalized() for i in range(3)]
    return Matrix([[columns[j][i] for j in range(3)] + [matrix.col[3][i]] for i in range(3)] + [[0, 0, 0, 1]])


def picture_size(scene):
    percent = scene.render.resolution_percentage / 100
    return max(1, int(scene.render.resolution_x * percent)), max(1, int(scene.render.resolution_y * percent))


def _film(report, scene, shift):
    """The film. A shifted lens is a crop of a wider film; so is a border. Returns it with how much wider it is."""
    width, height = picture_size(scene)
    along = max(width, height)
    pixels = [round(2 * abs(s) * along) for s in shift]
    for axis, s, p in zip("xy", shift, pixels):
        if abs(2 * abs(s) * along - p) > 1e-3:
            report.warn("camera %s" % scene.camera.name, "shift %s is %.4f pixels" % (axis, s * along),
                        "exported as %.1f" % math.copysign(p / 2, s))
    left = pixels[0] if shift[0] > 0 else 0
    top = pixels[1] if shift[1] < 0 else 0
    crop = [left, top, width, height]
    render = scene.render
    if render.use_border:
        crop = [left + round(render.border_min_x * width), top + round((1 - render.border_max_y) * height),
                max(1, round((render.border_max_x - render.border_min_x) * width)),
                max(1, round((render.border_max_y - render.border_min_y) * height))]
    film = elements.plugin("film", "hdrfilm")
    full = width + pixels[0], height + pixels[1]
    elements.add(film, "integer", "width", full[0])
    elements.add(film, "integer", "height", full[1])
    if crop != [0, 0, *full]:
        for name, value in zip(("crop_offset_x", "crop_offset_y", "crop_width", "crop_height"), crop):
            elements.add(film, "integer", name, value)
    elements.add(film, "string", "pixel_format", "rgba" if render.film_transparent else "rgb")
    elements.add(film, "string", "component_format", "float32")
    film.append(_filter(report, scene))
    return film, full


def _filter(report, scene):
    cycles = scene.cycles
    if cycles.pixel_filter_type == "BOX":
        if abs(cycles.filter_width - 1) > 1e-3:
            report.warn("scene " + scene.name, "a box filter of %.4g pixels isn't there" % cycles.filter_width,
                        "exported as one of a pixel")
        return elements.plugin("rfilter", "box")
    rfilter = elements.plugin("rfilter", "gaussian")
    if cycles.pixel_filter_type == "GAUSSIAN":
        deviation = cycles.filter_width / 4  # intern/cycles/scene/film.cpp: exp(-2 (6 x / 3 width)^2)
    else:
        deviation = 2 * cycles.filter_width * math.sqrt(BLACKMAN_HARRIS_VARIANCE)  # the window is twice as wide
        report.note("The Blackman-Harris filter is exported as a Gaussian of the same variance.")
    elements.add(rfilter, "float", "stddev", float(max(deviation, 0.01)))
    return rfilter


def _field_of_view(camera, scene):
    """(fov in degrees, axis) of the picture, before any shift."""
    width, height = picture_size(scene)
    fit = camera.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if width >= height else "VERTICAL"
        size = camera.sensor_width
    else:
        size = camera.sensor_width if fit == "HORIZONTAL" else camera.sensor_height
    return 2 * math.atan(size / (2 * camera.lens)), "x" if fit == "HORIZONTAL" else "y", size


def _wider(fov, axis, full, size):
    """The angle over the whole film, of which the picture is a crop."""
    index = "xy".index(axis)
    return 2 * math.atan(math.tan(fov / 2) * full[index] / size[index])


def _lens(report, camera, matrix, sensor):
    dof = camera.dof
    if camera.type == "ORTHO":
        return
    distance = dof.focus_distance
    if dof.focus_object:
        towards = matrix.to_3x3() @ _forward()
        distance = (dof.focus_object.matrix_world.translation - matrix.translation).dot(towards)
    elements.add(sensor, "float", "aperture_radius", camera.lens * 1e-3 / (2 * max(dof.aperture_fstop, 1e-4)))
    elements.add(sensor, "float", "focus_distance", float(max(distance, 1e-3)))
    if dof.aperture_blades > 2 or dof.aperture_ratio != 1:
        report.warn("camera " + camera.name, "its aperture isn't round", "exported as round")


def _forward():
    return Matrix.Identity(3).col[2] * -1


def _from_afar(report, camera, matrix, scene, radius):
    """A parallel projection as a perspective from so far off that the scene's depth is a thousandth of it."""
    width, height = picture_size(scene)
    away = 1000 * max(radius, camera.ortho_scale)
    along = width if camera.sensor_fit == "HORIZONTAL" or (camera.sensor_fit == "AUTO" and width >= height) else height
    axis = "x" if along == width else "y"
    report.warn("camera " + camera.name, "parallel projection isn't there",
                "exported as a perspective from %.4g away: lengths differ by up to 0.1 %%" % away)
    moved = Matrix.Translation(matrix.to_3x3() @ _forward() * -away) @ matrix
    return moved, 2 * math.atan(camera.ortho_scale / 2 / away), axis, away


def sensor(report, scene, depsgraph, radius, medium):
    """The sensor element. `radius`: of the scene about the camera; `medium`: id of what it stands in, or None."""
    source = scene.camera.evaluated_get(depsgraph)
    camera, matrix = source.data, rigid(source.matrix_world)
    away = 0.0
    if camera.type == "ORTHO":
        matrix, fov, axis, away = _from_afar(report, camera, matrix, scene, radius)
    else:
        fov, axis, _ = _field_of_view(camera, scene)
        if camera.type != "PERSP":
            report.warn("camera " + camera.name, "its projection (%s) isn't there" % camera.type.lower(),
                        "exported as a perspective")
    film, full = _film(report, scene, (camera.shift_x, camera.shift_y))
    has_lens = camera.dof.use_dof and camera.type != "ORTHO"
    element = elements.plugin("sensor", "thinlens" if has_lens else "perspective")
    elements.add(element, "float", "fov", math.degrees(_wider(fov, axis, full, picture_size(scene))))
    elements.add(element, "string", "fov_axis", axis)
    elements.add(element, "float", "near_clip", float(away + camera.clip_start))
    elements.add(element, "float", "far_clip", float(away + camera.clip_end))
    if has_lens:
        _lens(report, camera, matrix, element)
    # Blender's cameras look along -z with +x to the right, ours along +z with +x to the left.
    elements.add_matrix(element, matrix @ Matrix.Diagonal((-1, 1, -1, 1)))
    if medium:
        elements.add_ref(element, medium)
    sampler = elements.plugin("sampler", "ldsampler")
    elements.add(sampler, "integer", "sample_count", max(1, scene.cycles.samples))
    element.append(sampler)
    element.append(film)
    if abs(scene.render.pixel_aspect_x - scene.render.pixel_aspect_y) > 1e-6:
        report.warn("scene " + scene.name, "pixels aren't square", "exported as square ones")
    if scene.render.use_motion_blur:
        report.warn("scene " + scene.name, "motion blur isn't there", "exported as of the frame's own time")
    return element


def integrator(report, scene, has_scattering, hide_emitters):
    cycles = scene.cycles
    element = elements.plugin("integrator", "volpath")
    # Cycles counts bounces, Mitsuba edges: light straight from a lamp to a surface and on to the eye is 2.
    elements.add(element, "integer", "max_depth", cycles.max_bounces + 2)
    if has_scattering and cycles.volume_bounces == 0 and cycles.max_bounces > 0:
        elements.add(element, "boolean", "single_scattering", True)
    elif has_scattering and cycles.volume_bounces < cycles.max_bounces:
        report.warn("scene " + scene.name, "volumes scatter up to %d times in Cycles" % (cycles.volume_bounces + 1),
                    "limited only by all bounces, %d" % cycles.max_bounces)
    if hide_emitters:
        elements.add(element, "boolean", "hide_emitters", True)
    low = [name for name in ("diffuse", "glossy", "transmission")
           if getattr(cycles, name + "_bounces") < cycles.max_bounces]
    if low:
        report.warn("scene " + scene.name, "limits for %s bounces aren't there" % ", ".join(low),
                    "limited only by all bounces, %d" % cycles.max_bounces)
    biased = ["%s %.4g" % (name.replace("_", " "), getattr(cycles, name))
              for name in ("sample_clamp_direct", "sample_clamp_indirect", "blur_glossy")
              if getattr(cycles, name) > 0]
    biased += [name.replace("_", " ") + " off" for name in ("caustics_reflective", "caustics_refractive")
               if not getattr(cycles, name)]
    if biased:
        report.warn("scene " + scene.name, "what trades truth for less noise isn't there (%s)" % ", ".join(biased),
                    "exported without")
    return element
