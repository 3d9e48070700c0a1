"""Meshes as binary PLY, one file for each material of each mesh."""

import numpy


class Part:
    """What of a mesh has one material: a PLY file, and what its user must know."""

    def __init__(self, slot, path, face_normals):
        self.slot, self.path, self.face_normals = slot, path, face_normals


def _array(collection, attribute, count, kind, width):
    values = numpy.empty(count * width, dtype=kind)
    collection.foreach_get(attribute, values)
    return values.reshape(count, width) if width > 1 else values


class Arrays:
    """Corners of triangles: positions, normals, UV; and which material slot each triangle has."""

    def __init__(self, mesh):
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        vertices = _array(mesh.vertices, "co", len(mesh.vertices), numpy.float32, 3)
        self.indices = _array(mesh.loop_triangles, "vertices", count, numpy.int32, 3)
        loops = _array(mesh.loop_triangles, "loops", count, numpy.int32, 3)
        self.slots = _array(mesh.loop_triangles, "material_index", count, numpy.int32, 1)
        self.vertices = vertices
        self.positions = vertices[self.indices]
        self.normals = _array(mesh.corner_normals, "vector", len(mesh.loops), numpy.float32, 3)[loops]
        edges = numpy.cross(self.positions[:, 1] - self.positions[:, 0], self.positions[:, 2] - self.positions[:, 0])
        length = numpy.linalg.norm(edges, axis=1, keepdims=True)
        flat = edges / numpy.maximum(length, 1e-30)
        self.is_flat = bool(numpy.allclose(self.normals, flat[:, None, :], atol=1e-4)) if count else True
        layer = mesh.uv_layers.active
        # The layer that renders, not the one being edited.
        layer = next((uv for uv in mesh.uv_layers if uv.active_render), layer)
        self.uvs = _array(layer.uv, "vector", len(mesh.loops), numpy.float32, 2)[loops] if layer else None

    def is_closed(self):
        """Every edge has two triangles, once each way: then there is an inside."""
        edges = numpy.concatenate([self.indices[:, [0, 1]], self.indices[:, [1, 2]], self.indices[:, [2, 0]]])
        if not len(edges):
            return False
        forth = numpy.unique(edges, axis=0)
        back = numpy.unique(edges[:, ::-1], axis=0)
        return len(forth) == len(edges) and numpy.array_equal(forth, back)

    def mirrored(self):
        """As seen in a mirror across x, with its outside outside."""
        for array in (self.positions, self.normals):
            array[:, :, 0] *= -1
        self.vertices = self.vertices * numpy.array([-1, 1, 1], dtype=numpy.float32)
        self._turn()
        return self

    def backs(self, distance):
        """The same surface seen from behind, moved that way by `distance`."""
        self.positions = self.positions - distance * self.normals
        self.normals = -self.normals
        self._turn()
        return self

    def _turn(self):
        self.positions, self.normals = self.positions[:, ::-1], self.normals[:, ::-1]
        self.indices = self.indices[:, ::-1]
        if self.uvs is not None:
            self.uvs = self.uvs[:, ::-1]


def write(arrays, slot, path):
    """Triangles of one slot as PLY; whether it holds no normals because they are the faces' own."""
    chosen = arrays.slots == slot
    columns = [arrays.positions[chosen]]
    names = ["x", "y", "z"]
    if not arrays.is_flat:
        columns.append(arrays.normals[chosen])
        names += ["nx", "ny", "nz"]
    if arrays.uvs is not None:
        columns.append(arrays.uvs[chosen])
        names += ["u", "v"]
    corners = numpy.concatenate(columns, axis=2).reshape(-1, len(names)).astype("<f4")
    rows, index = numpy.unique(corners, axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    faces = numpy.empty(len(index), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, index
    header = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(rows)
    header += "".join("property float %s\n" % name for name in names)
    header += "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces)
    with open(path, "wb") as file:
        file.write(header.encode("ascii"))
        file.write(rows.tobytes())
        file.write(faces.tobytes())
    return arrays.is_flat
