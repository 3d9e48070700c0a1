"""Surface shaders as BSDFs: diffuse, metals, smooth glass and nothing at all; and what they emit."""

import math

from . import elements, images, nodes

BLACK = (0.0, 0.0, 0.0)
WHITE = (1.0, 1.0, 1.0)


class Texture:
    """A picture over UV coordinates, as a <texture> without its name."""

    def __init__(self, element, mean):
        self.element, self.mean = element, mean


class Surface:
    """`bsdf` is an element's kind with its properties, None where a shader only emits."""

    def __init__(self, bsdf=None, emission=BLACK, **properties):
        self.bsdf, self.emission, self.properties = bsdf, emission, properties

    def is_plain(self):
        return self.bsdf == "diffuse" and not isinstance(self.properties["reflectance"], Texture)


def mean_of(value):
    return value.mean if isinstance(value, Texture) else value


def _clipped(values):
    return tuple(min(max(x, 0.0), 1.0) for x in values)


def eta_of_reflectance(values):
    """The index, without absorption, whose Fresnel reflectance straight on is `values`; it rises to 1 at grazing
    angles much as Schlick's approximation does."""
    roots = [math.sqrt(min(max(x, 0.0), 0.9995)) for x in values]
    return [(1 + r) / (1 - r) for r in roots]


class Materials:
    """Reads materials once each. element(surface, id) makes the BSDF of what read() found."""

    def __init__(self, report, folder):
        self._report, self._folder, self._images = report, folder, {}

    # ---- colours ------------------------------------------------------------------------------------------------

    def _uv_transform(self, owner, place):
        """2x3 rows that take Blender's (u, v) to the picture's, whose v runs downwards; None if it isn't by UV."""
        rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        vector = place.input("Vector")
        if vector.node is not None and vector.node.type == "MAPPING":
            mapping = vector
            turn = nodes.constant(mapping.input("Rotation")) or BLACK
            scale = nodes.constant(mapping.input("Scale")) or WHITE
            move = nodes.constant(mapping.input("Location")) or BLACK
            if mapping.node.vector_type != "POINT" or turn[0] or turn[1]:
                self._report.warn(nodes.label(owner, mapping.node), "is more than a turn, a scale and a shift of UV",
                                  "exported as those")
            cosine, sine = math.cos(turn[2]), math.sin(turn[2])
            rows = [[cosine * scale[0], -sine * scale[1], move[0]], [sine * scale[0], cosine * scale[1], move[1]]]
            vector = mapping.input("Vector")
        by_uv = vector.node is None or vector.node.type == "UVMAP" or (
            vector.node.type == "TEX_COORD" and vector.socket.name == "UV")
        # An image texture without a vector takes UV; a mapping without one takes nothing.
        if vector.node is None and place.input("Vector").node is not None:
            by_uv = False
        if not by_uv:
            return None
        return [rows[0], [-rows[1][0], -rows[1][1], 1 - rows[1][2]]]

    def _image_texture(self, owner, place):
        node, image = place.node, place.node.image
        where = nodes.label(owner, node)
        values = images.pixels(image) if image else None
        if values is None:
            self._report.warn(where, "has no picture", "exported as magenta, as Cycles shows it")
            return (1.0, 0.0, 1.0)
        linear = images.is_linear(image)
        if not linear and image.colorspace_settings.name != "sRGB":
            self._report.warn(where, "the colour space %s isn't read" % image.colorspace_settings.name,
                              "exported as sRGB")
        mean = values.reshape(-1, 3).astype(float)
        if not linear:
            mean = ((mean + 0.055) / 1.055).clip(0) ** 2.4 * (mean > 0.04045) + mean / 12.92 * (mean <= 0.04045)
        mean = tuple(mean.mean(0))
        to_uv = self._uv_transform(owner, place)
        if to_uv is None or node.projection != "FLAT":
            self._report.warn(where, "isn't placed by UV coordinates", "exported as the picture's mean colour")
            return mean
        if image.name not in self._images:
            self._images[image.name] = images.export(self._folder, image)
        texture = elements.plugin("texture", "bitmap")
        elements.add(texture, "string", "filename", self._images[image.name])
        if linear:
            elements.add(texture, "boolean", "raw", True)
        if not linear and node.interpolation != "Closest":
            self._report.note("%s: Cycles interpolates between texels before it makes them linear, brume after." % where)
        if node.interpolation == "Closest":
            elements.add(texture, "string", "filter_type", "nearest")
        elif node.interpolation != "Linear":
            self._report.warn(where, "interpolates by %s" % node.interpolation, "exported as bilinear")
        wrap = {"EXTEND": "clamp", "MIRROR": "mirror"}.get(node.extension)
        if node.extension == "CLIP":
            self._report.warn(where, "is black outside the picture", "exported with the picture's edge continued")
            wrap = "clamp"
        if wrap:
            elements.add(texture, "string", "wrap_mode", wrap)
        elements.add_matrix(texture, [to_uv[0][:2] + [0, to_uv[0][2]], to_uv[1][:2] + [0, to_uv[1][2]],
                                      [0, 0, 1, 0], [0, 0, 0, 1]], "to_uv")
        return Texture(texture, mean)

    def _colour(self, owner, place, name):
        """Three numbers or a Texture."""
        source = place.input(name)
        if source is not None and source.node is not None and source.node.type == "TEX_IMAGE":
            if source.socket.name == "Color":
                return self._image_texture(owner, source)
        return nodes.colour(self._report, owner, place, name)

    def _flat_colour(self, owner, place, name, why):
        value = self._colour(owner, place, name)
        if isinstance(value, Texture):
            self._report.warn(nodes.label(owner, place.node), "%s can't have a texture" % why,
                              "exported with its mean colour")
        return mean_of(value)

    # ---- shaders ------------------------------------------------------------------------------------------------

    def _scalar(self, owner, place, name, otherwise=0.0):
        return nodes.scalar(self._report, owner, place, name, otherwise)

    def _lost(self, owner, place, problem, instead="it is left out"):
        self._report.warn(nodes.label(owner, place.node), problem, instead)

    def _metal(self, owner, place, roughness, **properties):
        distribution = getattr(place.node, "distribution", "GGX")
        if roughness > 0 and distribution == "MULTI_GGX":
            self._lost(owner, place, "Multiscatter GGX isn't there",
                       "exported as GGX, which loses light where it is rough")
        elif roughness > 0 and distribution == "ASHIKHMIN_SHIRLEY":
            self._lost(owner, place, "there is no Ashikhmin-Shirley", "exported as Beckmann")
        for name in ("Anisotropy", "Anisotropic"):
            if place.input(name) is not None and self._scalar(owner, place, name) != 0:
                self._lost(owner, place, "anisotropic reflection isn't exported", "exported as isotropic")
        if roughness ** 2 < 1e-4:
            return Surface("conductor", **properties)
        return Surface("roughconductor", alpha=roughness ** 2, distribution="beckmann" if distribution in (
            "BECKMANN", "ASHIKHMIN_SHIRLEY") else "ggx", **properties)

    def _glass(self, owner, place, reflectance, transmittance):
        if self._scalar(owner, place, "Roughness") > 1e-3:
            self._lost(owner, place, "there is no rough glass", "exported as smooth")
        return Surface("dielectric", int_ior=max(self._scalar(owner, place, "IOR"), 1e-3), ext_ior=1.0,
                       specular_reflectance=_clipped(reflectance), specular_transmittance=_clipped(transmittance))

    def _principled(self, owner, place):
        get = lambda name, otherwise=0.0: self._scalar(owner, place, name, otherwise)
        strength = get("Emission Strength")
        glow = BLACK
        if strength > 0:
            glow = tuple(strength * x for x in self._flat_colour(owner, place, "Emission Color", "emission"))
        metallic, transmission, alpha = get("Metallic"), get("Transmission Weight"), get("Alpha", 1.0)
        for name in ("Coat Weight", "Sheen Weight", "Subsurface Weight", "Thin Film Thickness"):
            if get(name) > 0:
                self._lost(owner, place, "%s is %.4g and isn't exported" % (name, get(name)))
        if 0 < alpha < 1:
            self._lost(owner, place, "Alpha is %.4g" % alpha, "exported as %s" % ("opaque" if alpha >= 0.5 else "nothing"))
        for name, value in (("Metallic", metallic), ("Transmission Weight", transmission)):
            if 0 < value < 1:
                self._lost(owner, place, "%s is %.4g, a mixture" % (name, value),
                           "exported as %d" % (value >= 0.5))
        if alpha < 0.5:
            return Surface("null")
        if metallic >= 0.5:
            colour = self._flat_colour(owner, place, "Base Color", "a metal")
            surface = self._metal(owner, place, get("Roughness"), eta=eta_of_reflectance(colour), k=BLACK)
        elif transmission >= 0.5:
            # Cycles: each crossing takes the root, so that going in and out again takes the colour.
            colour = self._flat_colour(owner, place, "Base Color", "glass")
            surface = self._glass(owner, place, WHITE, [math.sqrt(max(x, 0)) for x in colour])
        else:
            if get("Specular IOR Level") > 0 and get("IOR", 1.0) != 1:
                self._lost(owner, place, "the specular layer over the diffuse one isn't exported",
                           "only diffuse: set Specular IOR Level to 0 to see the same in Cycles")
            if get("Diffuse Roughness") > 0:
                self._lost(owner, place, "Diffuse Roughness isn't exported", "exported as Lambert's")
            surface = Surface("diffuse", reflectance=self._colour(owner, place, "Base Color"))
        surface.emission = glow
        return surface

    def _metallic(self, owner, place):
        roughness = self._scalar(owner, place, "Roughness")
        if place.node.fresnel_type == "PHYSICAL_CONDUCTOR":
            return self._metal(owner, place, roughness, eta=nodes.colour(self._report, owner, place, "IOR"),
                               k=nodes.colour(self._report, owner, place, "Extinction"))
        self._lost(owner, place, "the edge tint isn't exported", "reflectance rises to white at grazing angles")
        colour = self._flat_colour(owner, place, "Base Color", "a metal")
        return self._metal(owner, place, roughness, eta=eta_of_reflectance(colour), k=BLACK)

    def _bsdf(self, owner, place):
        kind = place.node.type
        if kind in ("BSDF_DIFFUSE", "BSDF_TRANSLUCENT", "SUBSURFACE_SCATTERING", "BSDF_TOON", "BSDF_SHEEN"):
            if kind != "BSDF_DIFFUSE":
                self._lost(owner, place, "there is nothing like it", "exported as diffuse reflection")
            elif self._scalar(owner, place, "Roughness") > 0:
                self._lost(owner, place, "there is no Oren-Nayar", "exported as Lambert's")
            return Surface("diffuse", reflectance=self._colour(owner, place, "Color"))
        if kind == "BSDF_GLOSSY":
            colour = self._flat_colour(owner, place, "Color", "a metal")
            return self._metal(owner, place, self._scalar(owner, place, "Roughness"),
                               specular_reflectance=_clipped(colour))
        if kind in ("BSDF_GLASS", "BSDF_REFRACTION"):
            colour = self._flat_colour(owner, place, "Color", "glass")
            if kind == "BSDF_REFRACTION":
                self._lost(owner, place, "refraction alone isn't there", "exported as glass that reflects nothing")
            return self._glass(owner, place, colour if kind == "BSDF_GLASS" else BLACK, colour)
        if kind == "BSDF_TRANSPARENT":
            colour = self._flat_colour(owner, place, "Color", "a transparent surface")
            if min(colour) < 0.999:
                self._lost(owner, place, "a transparent surface can't have a colour", "exported as clear")
            return Surface("null")
        return None

    def _combine(self, owner, place):
        """Mix and Add: emission is exact, and so are diffuse reflections; else the heavier BSDF is taken."""
        parts = [self.shade(owner, place.input("Shader", i)) for i in range(2)]
        weights = [1.0, 1.0]
        if place.node.type == "MIX_SHADER":
            share = min(max(self._scalar(owner, place, "Fac"), 0.0), 1.0)
            weights = [1 - share, share]
        glow = tuple(weights[0] * a + weights[1] * b for a, b in zip(parts[0].emission, parts[1].emission))
        live = [(w, p) for w, p in zip(weights, parts) if w > 0 and p.bsdf]
        if len(live) == 2 and all(p.is_plain() for _, p in live):
            total = tuple(sum(w * p.properties["reflectance"][i] for w, p in live) for i in range(3))
            return Surface("diffuse", glow, reflectance=_clipped(total))
        if not live:
            return Surface(None, glow)
        weight, best = max(live, key=lambda item: item[0])
        if len(live) == 2:
            self._lost(owner, place, "a mixture of %s and %s isn't there" % tuple(p.bsdf for p in parts),
                       "exported as %s alone" % best.bsdf)
        elif weight < 1 and best.is_plain():
            best.properties["reflectance"] = tuple(weight * x for x in best.properties["reflectance"])
        elif weight < 1:
            self._lost(owner, place, "a weakened %s isn't there" % best.bsdf, "exported at full strength")
        return Surface(best.bsdf, glow, **best.properties)

    def shade(self, owner, place):
        """The Surface of a shader; of none, a black one."""
        if place is None or place.node is None:
            return Surface(None)
        kind = place.node.type
        if kind in ("MIX_SHADER", "ADD_SHADER"):
            return self._combine(owner, place)
        if kind == "EMISSION":
            strength = self._scalar(owner, place, "Strength")
            colour = self._flat_colour(owner, place, "Color", "emission")
            return Surface(None, tuple(strength * x for x in colour))
        normal = place.input("Normal")
        if normal is not None and normal.node is not None:
            self._lost(owner, place, "its normal comes from the node %s" % normal.node.name, "exported without")
        if kind == "BSDF_PRINCIPLED":
            return self._principled(owner, place)
        if kind == "BSDF_METALLIC":
            return self._metallic(owner, place)
        surface = self._bsdf(owner, place)
        if surface is None:
            self._lost(owner, place, "the shader isn't exported", "exported as diffuse, 0.5")
            surface = Surface("diffuse", reflectance=(0.5,) * 3)
        return surface

    def read(self, material):
        """The Surface of a material; of None, what Cycles shows where there is none."""
        if material is None:
            return Surface("diffuse", reflectance=(0.8,) * 3)
        owner = "material " + material.name
        if not material.use_nodes or not material.node_tree:
            return Surface("diffuse", reflectance=tuple(material.diffuse_color)[:3])
        if nodes.output(material.node_tree, "Displacement"):
            self._report.warn(owner, "displacement isn't exported", "it is left out")
        place = nodes.output(material.node_tree, "Surface")
        if place is None and nodes.output(material.node_tree, "Volume"):
            return Surface("null")
        return self.shade(owner, place)

    @staticmethod
    def element(surface, identifier):
        """The BSDF; both sides of what isn't glass, as in Cycles. None for a surface that only emits."""
        if surface.bsdf is None:
            return None
        bsdf = elements.plugin("bsdf", surface.bsdf)
        for name, value in surface.properties.items():
            if isinstance(value, Texture):
                value.element.set("name", name)
                bsdf.append(value.element)
            elif isinstance(value, str):
                elements.add(bsdf, "string", name, value)
            elif isinstance(value, float):
                elements.add(bsdf, "float", name, value)
            else:
                elements.add(bsdf, "rgb", name,
                             _clipped(value) if name == "reflectance" else value)
        if surface.bsdf not in ("dielectric", "null"):
            both = elements.plugin("bsdf", "twosided")
            both.append(bsdf)
            bsdf = both
        bsdf.set("id", identifier)
        return bsdf
