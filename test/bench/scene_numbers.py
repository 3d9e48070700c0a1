"""The numbers in a scene file of scenes/bench/, for renderers that don't read Mitsuba's format.

read(path, parameters) gives a Scene. Only what those files use is understood; anything else is an error, so that nobody
renders something else unnoticed.
"""

import math
import os
import xml.etree.ElementTree as ElementTree

import numpy


class Mesh:
    """Triangles in world space; radiance is None where nothing is emitted, and sides says what of a rectangle."""

    def __init__(self, points, triangles, reflectance, radiance):
        self.points, self.triangles, self.reflectance, self.radiance = points, triangles, reflectance, radiance


class Spot:
    """Of one intensity (W/sr, RGB) within `cutoff` degrees of its axis."""

    def __init__(self, position, target, intensity, cutoff):
        self.position, self.target, self.intensity, self.cutoff = position, target, intensity, cutoff


class Scene:
    """meshes, spots; medium (sigma_t, albedo, g) or None; camera origin, target, up, fov (degrees, along x); depth."""

    def __init__(self):
        self.meshes, self.spots, self.medium, self.bsdfs = [], [], None, {}


CUBE = numpy.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
SQUARE = numpy.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)


def read(path, parameters):
    scene, values = Scene(), dict(parameters)
    _read_file(path, scene, values)
    return scene


def _read_file(path, scene, values):
    for node in ElementTree.parse(path).getroot():
        if node.tag == "default":
            values.setdefault(node.get("name"), node.get("value"))
        elif node.tag == "include":
            _read_file(os.path.join(os.path.dirname(path), node.get("filename")), scene, values)
        elif node.tag == "integrator":
            scene.depth = int(_value(_child(node, "max_depth"), values))
        elif node.tag == "bsdf":
            scene.bsdfs[node.get("id")] = _numbers(node.find("bsdf/rgb"), values)
        elif node.tag == "medium":
            scene.medium = (_numbers(_child(node, "sigma_t"), values)[0], _numbers(_child(node, "albedo"), values)[0],
                            _numbers(node.find("phase/float"), values)[0])
        elif node.tag == "sensor":
            view = node.find("transform/lookat")
            scene.origin, scene.target, scene.up = (_split(view.get(name)) for name in ("origin", "target", "up"))
            scene.fov = _numbers(_child(node, "fov"), values)[0]
            scene.width, scene.height = (int(_value(_child(node.find("film"), name), values))
                                         for name in ("width", "height"))
        elif node.tag == "emitter" and node.get("type") == "spot":
            view = node.find("transform/lookat")
            assert _value(_child(node, "cutoff_angle"), values) == _value(_child(node, "beam_width"), values)
            scene.spots.append(Spot(_split(view.get("origin")), _split(view.get("target")),
                                    _numbers(_child(node, "intensity"), values),
                                    _numbers(_child(node, "cutoff_angle"), values)[0]))
        elif node.tag == "shape":
            scene.meshes.append(_shape(node, os.path.dirname(path), scene, values))
        else:
            raise ValueError("%s: <%s> is not understood" % (path, node.tag))


def _shape(node, folder, scene, values):
    kind = node.get("type")
    if kind == "cube":
        points, faces = CUBE, CUBE_FACES
    elif kind == "rectangle":
        points, faces = SQUARE, [(0, 1, 2, 3)]
    elif kind == "ply":
        points, faces = _read_ply(os.path.join(folder, _value(_child(node, "filename"), values)))
    else:
        raise ValueError("shape %s is not understood" % kind)
    matrix = _transform(node.find("transform"))
    points = points @ matrix[:3, :3].T + matrix[:3, 3]
    triangles = numpy.array([(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)])
    emitter, reference = node.find("emitter"), node.find("ref")
    radiance = _numbers(_child(emitter, "radiance"), values) if emitter is not None else None
    reflectance = scene.bsdfs[reference.get("id")] if reference is not None else numpy.zeros(3)
    return Mesh(points, triangles, reflectance, radiance)


def _read_ply(path):
    lines = open(path, encoding="ascii").read().split("\n")
    vertices = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    faces = next(int(line.split()[2]) for line in lines if line.startswith("element face"))
    body = lines[lines.index("end_header") + 1:]
    points = numpy.array([[float(x) for x in line.split()] for line in body[:vertices]])
    return points, [tuple(int(x) for x in line.split()[1:]) for line in body[vertices:vertices + faces]]


def _transform(node):
    matrix = numpy.eye(4)
    for step in node:
        m = numpy.eye(4)
        if step.tag == "scale":
            m[:3, :3] = numpy.diag([float(step.get(axis, step.get("value", 1))) for axis in "xyz"])
        elif step.tag == "translate":
            m[:3, 3] = [float(step.get(axis, 0)) for axis in "xyz"]
        elif step.tag == "rotate" and step.get("x") == "1":
            a = math.radians(float(step.get("angle")))
            m[1:3, 1:3] = [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
        elif step.tag == "lookat":
            right, up, forward = frame(*(_split(step.get(name)) for name in ("origin", "target", "up")))
            m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = -right, up, forward, _split(step.get("origin"))
        else:
            raise ValueError("<%s> is not understood" % step.tag)
        matrix = m @ matrix
    return matrix


def frame(origin, target, up):
    """Unit vectors to the right, up and forward of someone who looks from origin to target."""
    forward = (target - origin) / numpy.linalg.norm(target - origin)
    right = numpy.cross(forward, up)
    right /= numpy.linalg.norm(right)
    return right, numpy.cross(right, forward), forward


def _child(node, name):
    found = [child for child in node if child.get("name") == name]
    if len(found) != 1:
        raise ValueError("<%s> needs one %s" % (node.tag, name))
    return found[0]


def _value(node, values):
    text = node.get("value")
    return values[text[1:]] if text.startswith("$") else text


def _split(text):
    return numpy.array([float(x) for x in str(text).split(",")])


def _numbers(node, values):
    numbers = _split(_value(node, values))
    return numpy.repeat(numbers, 3) if len(numbers) == 1 else numbers
