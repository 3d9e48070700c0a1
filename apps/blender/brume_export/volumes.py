"""Volume shaders as homogeneous media."""

from . import elements, nodes


class Medium:
    """Coefficients per unit of length in three colours, and the mean cosine of scattering."""

    def __init__(self, sigma_s=(0, 0, 0), sigma_a=(0, 0, 0), emission=(0, 0, 0), g=0.0):
        self.sigma_s, self.sigma_a, self.emission, self.g = sigma_s, sigma_a, emission, g

    def __bool__(self):
        return any(self.sigma_s) or any(self.sigma_a) or any(self.emission)

    def scaled(self, factor):
        return Medium(*(tuple(factor * x for x in values) for values in
                        (self.sigma_s, self.sigma_a, self.emission)), self.g)

    def plus(self, other, report, what):
        """Both in one place, as Cycles has it. One Henyey-Greenstein lobe can't be two: its g is then the mean."""
        mine, theirs = sum(self.sigma_s), sum(other.sigma_s)
        g = self.g if mine else other.g
        if mine and theirs and abs(self.g - other.g) > 1e-6:
            g = (mine * self.g + theirs * other.g) / (mine + theirs)
            report.warn(what, "scatters with g = %.4g and %.4g in one place" % (self.g, other.g),
                        "exported with their mean, %.4g" % g)
        return Medium(*(tuple(a + b for a, b in zip(x, y)) for x, y in
                        ((self.sigma_s, other.sigma_s), (self.sigma_a, other.sigma_a),
                         (self.emission, other.emission))), g)

    def element(self, identifier, exposure):
        medium = elements.plugin("medium", "homogeneous", identifier)
        sigma_t = [s + a for s, a in zip(self.sigma_s, self.sigma_a)]
        # Mitsuba takes no sigma_t above 1: what exceeds it goes into the scale.
        scale = max(1.0, *sigma_t)
        elements.add(medium, "rgb", "sigma_t", [x / scale for x in sigma_t])
        if scale > 1:
            elements.add(medium, "float", "scale", float(scale))
        elements.add(medium, "rgb", "albedo", [s / t if t > 0 else 0.0 for s, t in zip(self.sigma_s, sigma_t)])
        if any(self.emission):
            elements.add(medium, "rgb", "emission", [exposure * x for x in self.emission])
        phase = elements.plugin("phase", "hg" if self.g else "isotropic")
        if self.g:
            elements.add(phase, "float", "g", float(self.g))
        medium.append(phase)
        return medium


def _positive(values):
    return tuple(max(0.0, x) for x in values)


def _anisotropy(report, owner, place):
    phase = getattr(place.node, "phase", "HENYEY_GREENSTEIN")
    if phase == "HENYEY_GREENSTEIN":
        return min(max(nodes.scalar(report, owner, place, "Anisotropy"), -0.999), 0.999)
    if phase == "DRAINE":
        g = nodes.scalar(report, owner, place, "Anisotropy")
    else:
        g = {"RAYLEIGH": 0.0, "FOURNIER_FORAND": 0.9, "MIE": 0.9}.get(phase, 0.0)
    report.warn(nodes.label(owner, place.node), "there is no phase function %s" % phase.lower().replace("_", " "),
                "exported as Henyey-Greenstein with g = %.4g" % g)
    return g


def _principled(report, owner, place):
    """As Cycles computes it (intern/cycles/kernel/svm/closure.h): the absorption colour counts by its square root."""
    density = max(0.0, nodes.scalar(report, owner, place, "Density"))
    colour = _positive(nodes.colour(report, owner, place, "Color"))
    absorption = _positive(nodes.colour(report, owner, place, "Absorption Color"))
    strength = nodes.scalar(report, owner, place, "Emission Strength")
    glow = nodes.colour(report, owner, place, "Emission Color")
    if nodes.scalar(report, owner, place, "Blackbody Intensity") > 0:
        report.warn(nodes.label(owner, place.node), "blackbody emission isn't exported", "it is left out")
    return Medium(tuple(density * c for c in colour),
                  tuple(density * max(1 - c, 0) * max(1 - a ** 0.5, 0) for c, a in zip(colour, absorption)),
                  _positive(strength * x for x in glow), _anisotropy(report, owner, place))


def _read_node(report, owner, place):
    kind = place.node.type
    if kind == "PRINCIPLED_VOLUME":
        return _principled(report, owner, place)
    if kind in ("VOLUME_SCATTER", "VOLUME_ABSORPTION"):
        density = max(0.0, nodes.scalar(report, owner, place, "Density"))
        colour = nodes.colour(report, owner, place, "Color")
        if kind == "VOLUME_ABSORPTION":
            return Medium(sigma_a=_positive(density * (1 - c) for c in colour))
        return Medium(_positive(density * c for c in colour), g=_anisotropy(report, owner, place))
    if kind == "VOLUME_COEFFICIENTS":
        return Medium(*(_positive(nodes.colour(report, owner, place, name)) for name in
                        ("Scatter Coefficients", "Absorption Coefficients", "Emission Coefficients")),
                      _anisotropy(report, owner, place))
    if kind == "EMISSION":
        strength = nodes.scalar(report, owner, place, "Strength")
        return Medium(emission=_positive(strength * x for x in nodes.colour(report, owner, place, "Color")))
    report.warn(nodes.label(owner, place.node), "is no volume shader that is exported", "it is left out")
    return Medium()


def read(report, owner, place):
    """The Medium of a shader; an empty one for none."""
    if place is None or place.node is None:
        return Medium()
    kind = place.node.type
    if kind not in ("ADD_SHADER", "MIX_SHADER"):
        return _read_node(report, owner, place)
    parts = [read(report, owner, place.input("Shader", i)) for i in range(2)]
    if kind == "MIX_SHADER":
        share = min(max(nodes.scalar(report, owner, place, "Fac"), 0.0), 1.0)
        parts = [parts[0].scaled(1 - share), parts[1].scaled(share)]
    return parts[0].plus(parts[1], report, nodes.label(owner, place.node))
