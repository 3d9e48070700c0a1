"""Lamps: point and spot lights, suns, area lights. Cycles gives all but suns their power in watts; of an isotropic lamp
of power P the radiant intensity is P / 4 pi, of an area light of area A the radiance is P / pi A."""

import math

import numpy
from mathutils import Matrix

from . import elements, images, nodes
from .camera import rigid

# A spot's blend below this is as good as linear: the ramp is a fortieth of the beam's radius.
NARROW_BLEND = 0.05
# Beyond this half angle a gobo, which lies in a plane, would need too many texels.
WIDEST_GOBO = math.radians(75)


def spot_falloff(cosine, half_angle, blend):
    """What Cycles multiplies a spot's intensity by: a smoothstep of the cosine."""
    edge = math.cos(half_angle)
    x = numpy.clip((cosine - edge) / max((1 - edge) * blend, 1e-12), 0, 1)
    return x * x * (3 - 2 * x)


def linear_falloff(angle, half_angle, beam):
    return numpy.clip((half_angle - angle) / max(half_angle - beam, 1e-12), 0, 1)


def matching_beam(half_angle, blend):
    """The beam width whose linear falloff gives the same flux, and the largest difference of the two falloffs."""
    angle = (numpy.arange(4000) + 0.5) / 4000 * half_angle
    wanted = spot_falloff(numpy.cos(angle), half_angle, blend)
    low, high = 0.0, half_angle
    for _ in range(50):
        middle = 0.5 * (low + high)
        excess = ((linear_falloff(angle, half_angle, middle) - wanted) * numpy.sin(angle)).sum()
        low, high = (low, middle) if excess > 0 else (middle, high)
    return low, abs(linear_falloff(angle, half_angle, low) - wanted).max()


class Lights:
    def __init__(self, report, folder, exposure, spot_falloff_kind="exact"):
        self._report, self._folder, self._exposure = report, folder, exposure
        self._kind, self._gobos = spot_falloff_kind, {}

    def _strength(self, lamp, where):
        """Power (a sun's irradiance) per colour, times the film's exposure."""
        colour = tuple(lamp.color)
        if getattr(lamp, "use_temperature", False):
            colour = tuple(c * t for c, t in zip(colour, lamp.temperature_color))
        factor = lamp.energy * 2.0 ** getattr(lamp, "exposure", 0.0) * self._exposure
        if lamp.use_nodes and lamp.node_tree:
            factor, colour = self._nodes(lamp, where, factor, colour)
        return [factor * c for c in colour]

    def _nodes(self, lamp, where, factor, colour):
        place = nodes.output(lamp.node_tree, "Surface")
        if place is None or place.node.type != "EMISSION":
            self._report.warn(where, "its nodes are more than one Emission", "exported by its own power and colour")
            return factor, colour
        strength = nodes.scalar(self._report, where, place, "Strength")
        return factor * strength, tuple(a * b for a, b in zip(colour, nodes.colour(
            self._report, where, place, "Color")))

    def _common(self, lamp, source, where):
        for name in ("diffuse_factor", "specular_factor", "transmission_factor", "volume_factor"):
            if getattr(lamp, name, 1.0) != 1:
                self._report.note("%s: %s is for Eevee alone." % (where, name))
        hidden = [ray for ray in ("diffuse", "glossy", "transmission", "volume_scatter")
                  if not getattr(source, "visible_" + ray)]
        if hidden:
            self._report.warn(where, "it is hidden from %s rays" % ", ".join(hidden), "exported as seen by them")
        if not getattr(lamp.cycles, "cast_shadow", True) or not lamp.use_shadow:
            self._report.warn(where, "it casts no shadows", "exported as any other")
        if lamp.cycles.max_bounces < 1024:
            self._report.warn(where, "it lights up to %d bounces only" % lamp.cycles.max_bounces,
                              "exported without a limit")

    # ---- one kind each ------------------------------------------------------------------------------------------

    def _point(self, lamp, source, matrix, where):
        radius = lamp.shadow_soft_size
        power = self._strength(lamp, where)
        normalize = getattr(lamp, "normalize", True)
        if radius <= 0:
            emitter = elements.plugin("emitter", "point")
            elements.add(emitter, "point", "position", tuple(matrix.translation))
            elements.add(emitter, "rgb", "intensity", [p / (4 * math.pi) for p in power])
            return [emitter]
        area = math.pi * radius ** 2 if normalize else 1.0
        if lamp.use_soft_falloff:
            self._report.note("%s: soft falloff is exported as a ball; they differ by (radius/distance)^2." % where)
        return [self._surface("sphere", Matrix.Translation(matrix.translation) @ Matrix.Scale(radius, 4),
                              [p / (4 * math.pi * area) for p in power])]

    @staticmethod
    def _surface(shape, matrix, radiance):
        """A lamp with extent hides nothing: light passes through it."""
        element = elements.plugin("shape", shape)
        elements.add_matrix(element, matrix)
        element.append(elements.plugin("bsdf", "null"))
        emitter = elements.plugin("emitter", "area")
        elements.add(emitter, "rgb", "radiance", radiance)
        element.append(emitter)
        return element

    def _gobo(self, half_angle, blend):
        """A texture over the square about the cone's base that holds the falloff."""
        key = (round(half_angle, 9), round(blend, 9))
        if key not in self._gobos:
            size = min(1024, max(128, 2 * int(32 / blend)))
            side = ((numpy.arange(size) + 0.5) / size * 2 - 1) * math.tan(half_angle)
            cosine = 1 / numpy.sqrt(1 + side[None, :] ** 2 + side[:, None] ** 2)
            falloff = spot_falloff(cosine, half_angle, blend)
            name = self._folder.new("spot-%.4g-%.4g" % (math.degrees(half_angle), blend), ".exr")
            images.write_exr(self._folder.path(name), falloff[:, :, None].repeat(3, axis=2))
            self._gobos[key] = name
        texture = elements.plugin("texture", "bitmap", name="texture")
        elements.add(texture, "string", "filename", self._gobos[key])
        elements.add(texture, "boolean", "raw", True)
        elements.add(texture, "string", "wrap_mode", "clamp")
        return texture

    def _spot(self, lamp, source, matrix, where):
        half, blend = lamp.spot_size / 2, lamp.spot_blend
        scale = matrix.to_scale()
        if max(scale) - min(scale) > 1e-4 * max(scale):
            self._report.warn(where, "its cone is stretched by the object's scale", "exported as a round one")
        if lamp.shadow_soft_size > 0:
            self._report.warn(where, "a spot has no extent, and this one has a radius of %.4g" %
                              lamp.shadow_soft_size, "exported as a point: its shadows are sharp")
        if not getattr(lamp, "normalize", True) and lamp.shadow_soft_size > 0:
            self._report.warn(where, "its power isn't normalised by its size", "exported as if it were")
        emitter = elements.plugin("emitter", "spot")
        # Lamps shine along -z; a half turn about x keeps the frame right-handed.
        elements.add_matrix(emitter, rigid(matrix) @ Matrix.Diagonal((1, -1, -1, 1)))
        elements.add(emitter, "rgb", "intensity", [p / (4 * math.pi) for p in self._strength(lamp, where)])
        elements.add(emitter, "float", "cutoff_angle", math.degrees(half))
        exact = self._kind == "exact" and blend > NARROW_BLEND and half <= WIDEST_GOBO
        beam, difference = (half, 0.0) if exact or blend <= 0 else matching_beam(half, blend)
        elements.add(emitter, "float", "beam_width", math.degrees(beam))
        if exact:
            emitter.append(self._gobo(half, blend))
        elif blend > 0:
            self._report.warn(where, "its falloff is exported as linear in the angle",
                              "of the same flux, off by up to %.2g of the intensity on the axis" % difference)
        return [emitter]

    def _sun(self, lamp, source, matrix, where):
        irradiance = self._strength(lamp, where)
        if not getattr(lamp, "normalize", True) and lamp.angle > 0:
            irradiance = [e * math.pi * math.sin(min(lamp.angle, math.pi) / 2) ** 2 for e in irradiance]
        if lamp.angle > 0:
            self._report.warn(where, "a sun has no extent, and this one has %.3g degrees" % math.degrees(lamp.angle),
                              "its rays are parallel: shadows are sharp instead of %.3g wide at a distance of 1"
                              % (2 * math.tan(min(lamp.angle, 3) / 2)))
        emitter = elements.plugin("emitter", "directional")
        elements.add(emitter, "vector", "direction", tuple(-matrix.col[2].to_3d().normalized()))
        elements.add(emitter, "rgb", "irradiance", irradiance)
        return [emitter]

    def _area(self, lamp, source, matrix, where):
        if lamp.cycles.is_portal:
            self._report.note("%s: a portal changes noise only." % where)
            return []
        if lamp.spread < math.pi - 1e-4:
            self._report.warn(where, "its light spreads over %.4g degrees only" % math.degrees(lamp.spread),
                              "exported as shining to all sides")
        width = lamp.size * matrix.col[0].to_3d().length
        height = (lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size) * matrix.col[1].to_3d().length
        is_round = lamp.shape in ("DISK", "ELLIPSE")
        area = width * height * (math.pi / 4 if is_round else 1) if getattr(lamp, "normalize", True) else 1.0
        if abs(matrix.col[0].to_3d().dot(matrix.col[1].to_3d())) > 1e-4 * matrix.col[0].to_3d().length_squared:
            self._report.warn(where, "it is sheared", "exported without")
        shape, size = "rectangle", (width / 2, -height / 2, -1, 1)
        if is_round and abs(width - height) > 1e-4 * width:
            self._report.warn(where, "there is no ellipse", "exported as a rectangle of the same area")
            size = (size[0] * math.sqrt(math.pi) / 2, size[1] * math.sqrt(math.pi) / 2, -1, 1)
        elif is_round:
            shape, size = "disk", (width / 2, -width / 2, -width / 2, 1)
        # Lamps shine along -z, shapes along +z: a half turn about x.
        return [self._surface(shape, rigid(matrix) @ Matrix.Diagonal(size),
                              [p / (math.pi * area) for p in self._strength(lamp, where)])]

    def export(self, source, matrix):
        """The elements of one lamp object."""
        lamp, where = source.data, "light " + source.name
        self._common(lamp, source, where)
        kinds = {"POINT": self._point, "SPOT": self._spot, "SUN": self._sun, "AREA": self._area}
        return kinds[lamp.type](lamp, source, matrix, where)
