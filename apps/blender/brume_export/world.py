"""The world: its background as a constant or a map, and its volume."""

import math

import numpy
from mathutils import Matrix

from . import elements, images, nodes, volumes

# A map's own axes in Blender's: its row 0 is up, and u runs the same way round.
MAP_TO_WORLD = Matrix(((0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


def _rows_at_poles(rows):
    """A map whose first and last rows are the poles, as ours has them, from one whose rows lie half a row inside, as
    Blender has them. Twice as many rows hold the same interpolant exactly."""
    height = len(rows)
    out = numpy.empty((2 * height + 1,) + rows.shape[1:], dtype=numpy.float32)
    out[1::2] = rows
    out[2:-1:2] = 0.5 * (rows[:-1] + rows[1:])
    out[0], out[-1] = rows[0], rows[-1]
    return out


def _linear(values):
    low = values <= 0.04045
    return numpy.where(low, values / 12.92, ((numpy.maximum(values, 0) + 0.055) / 1.055) ** 2.4).astype(numpy.float32)


def _environment(report, folder, owner, place, strength):
    node, where = place.node, nodes.label(owner, place.node)
    rows = images.pixels(node.image) if node.image else None
    if rows is None or node.projection != "EQUIRECTANGULAR":
        report.warn(where, "has no picture" if rows is None else "a mirror ball isn't read", "exported as black")
        return None
    if not images.is_linear(node.image):
        rows = _linear(rows)
    matrix = MAP_TO_WORLD
    vector = place.input("Vector")
    if vector.node is not None and vector.node.type == "MAPPING":
        turn = nodes.constant(vector.input("Rotation")) or (0, 0, 0)
        scale = nodes.constant(vector.input("Scale")) or (1, 1, 1)
        if vector.node.vector_type not in ("POINT", "VECTOR") or max(abs(s - 1) for s in scale) > 1e-5:
            report.warn(nodes.label(owner, vector.node), "is more than a turn", "exported as its turn alone")
        # The node turns the direction that is looked up: the map turns the other way.
        matrix = (Matrix.Rotation(turn[2], 4, "Z") @ Matrix.Rotation(turn[1], 4, "Y") @
                  Matrix.Rotation(turn[0], 4, "X")).transposed() @ MAP_TO_WORLD
        vector = vector.input("Vector")
    if vector.node is not None and not (vector.node.type == "TEX_COORD" and vector.socket.name == "Generated"):
        report.warn(where, "its direction comes from the node %s" % vector.node.name, "exported as the view's own")
    name = folder.new("world-" + node.image.name, ".exr")
    images.write_exr(folder.path(name), _rows_at_poles(rows))
    emitter = elements.plugin("emitter", "envmap")
    elements.add(emitter, "string", "filename", name)
    elements.add(emitter, "float", "scale", float(strength))
    elements.add_matrix(emitter, matrix)
    return emitter


def _constant(radiance):
    if not any(radiance):
        return None
    emitter = elements.plugin("emitter", "constant")
    elements.add(emitter, "rgb", "radiance", [max(0.0, x) for x in radiance])
    return emitter


def background(report, folder, world, exposure):
    """The emitter of the world's Surface; None if it is black."""
    if world is None:
        return None
    owner = "world " + world.name
    if not world.use_nodes:
        return _constant([exposure * c for c in world.color])
    place = nodes.output(world.node_tree, "Surface")
    if place is None:
        return None
    if place.node.type not in ("BACKGROUND", "EMISSION"):
        report.warn(nodes.label(owner, place.node), "is no background that is exported", "exported as black")
        return None
    strength = exposure * max(0.0, nodes.scalar(report, owner, place, "Strength"))
    source = place.input("Color")
    if source.node is not None and source.node.type == "TEX_ENVIRONMENT":
        return _environment(report, folder, owner, source, strength)
    return _constant([strength * c for c in nodes.colour(report, owner, place, "Color")])


def volume(report, world):
    """The Medium of the world."""
    if world is None or not world.use_nodes:
        return volumes.Medium()
    return volumes.read(report, "world " + world.name, nodes.output(world.node_tree, "Volume"))
