"""Writes the small meshes and pictures in assets/ that the scenes here use; they are committed, so that the scenes open
anywhere. Run it (in crosscheck.py's virtual environment) only to change them. All of it is made from formulas."""

import os

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")
FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "assets")


def blob_point(u, v):
    """A bumpy closed surface about the origin, radius near 1, without any symmetry to hide a flipped axis."""
    theta, phi = numpy.pi * v, 2 * numpy.pi * u
    radius = 1 + 0.12 * numpy.sin(3 * phi + 1) * numpy.sin(theta) ** 3 + 0.1 * numpy.cos(2 * theta + 0.5)
    return radius * numpy.array(
        [numpy.sin(theta) * numpy.cos(phi), numpy.sin(theta) * numpy.sin(phi), numpy.cos(theta)])


def blob_normal(u, v, step=1e-4):
    v = min(max(v, 1e-3), 1 - 1e-3)
    du = blob_point(u + step, v) - blob_point(u - step, v)
    dv = blob_point(u, v + step) - blob_point(u, v - step)
    normal = numpy.cross(dv, du)
    return normal / numpy.linalg.norm(normal)


def write_blob(path, columns=14, rows=8):
    """A closed ASCII PLY with normals and texture coordinates (a seam column is doubled for the coordinates)."""
    vertices, faces = [], []
    for j in range(rows + 1):
        for i in range(columns + 1):
            u, v = i / columns, j / rows
            pole = j in (0, rows)
            position = blob_point(0 if pole else u, v)
            normal = numpy.array([0, 0, 1.0 if j == 0 else -1.0]) if pole else blob_normal(u, v)
            vertices.append([*position, *normal, u, v])
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            b, c, d = a + 1, a + columns + 1, a + columns + 2
            if j > 0:
                faces.append((a, c, b))
            if j < rows - 1:
                faces.append((b, c, d))
    with open(path, "w", encoding="ascii") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex %d\n" % len(vertices))
        for name in "x y z nx ny nz u v".split():
            file.write("property float %s\n" % name)
        file.write("element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces))
        for vertex in vertices:
            file.write(" ".join("%.6g" % (x + 0.0) for x in vertex) + "\n")
        for face in faces:
            file.write("3 %d %d %d\n" % face)


def write_pedestal(path):
    """A tapering box of four-sided faces with texture coordinates and no normals."""
    corners = [(x * s, y, z * s) for y, s in ((0, 1), (1, 0.6)) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = [(1, 2, 3, 4), (8, 7, 6, 5), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)]
    with open(path, "w", encoding="ascii") as file:
        file.write("o pedestal\n")
        for corner in corners:
            file.write("v %g %g %g\n" % corner)
        file.write("vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n")
        for face in faces:
            file.write("f " + " ".join("%d/%d" % (vertex, k + 1) for k, vertex in enumerate(face)) + "\n")


def write_letter(path):
    """16 x 16, 8 bits: a colour ramp with a letter F, so that flips, turns and the sRGB curve show."""
    y, x = numpy.mgrid[0:16, 0:16] / 15.0
    picture = numpy.stack([0.2 + 0.7 * x, 0.2 + 0.6 * y, 0.8 - 0.5 * x * y], -1)
    for rows, columns in ((slice(3, 13), slice(4, 6)), (slice(3, 5), slice(4, 12)), (slice(7, 9), slice(4, 10))):
        picture[rows, columns] = [0.95, 0.95, 0.3]
    bytes_ = numpy.round(picture * 255).astype(numpy.uint8)
    mitsuba.Bitmap(bytes_).write(path)


def write_waves(path):
    """12 x 8 floats in [0.05, 0.95]."""
    y, x = numpy.mgrid[0:8, 0:12]
    picture = numpy.stack([0.5 + 0.45 * numpy.sin(1.3 * x + 0.7 * y), 0.5 + 0.45 * numpy.cos(0.9 * x * y + 1),
                           0.5 + 0.45 * numpy.sin(2.1 * y - 0.4 * x)], -1)
    mitsuba.Bitmap(picture.astype(numpy.float32)).write(path)


def write_sky(path):
    """32 x 16: a gradient, a wide bright patch and a small very bright one, nothing symmetric."""
    y, x = numpy.mgrid[0:16, 0:32]
    picture = numpy.stack([0.3 + 0.02 * y, 0.4 + 0.01 * x, 0.9 - 0.04 * y], -1)
    picture[3:6, 5:9] += [6, 5, 3]
    picture[6:8, 20:22] += [2, 9, 14]
    picture[12:, :] *= 0.5
    picture[0, :] += 0.8
    mitsuba.Bitmap(picture.astype(numpy.float32)).write(path)


if __name__ == "__main__":
    os.makedirs(FOLDER, exist_ok=True)
    write_blob(os.path.join(FOLDER, "blob.ply"))
    write_pedestal(os.path.join(FOLDER, "pedestal.obj"))
    write_letter(os.path.join(FOLDER, "letter.png"))
    write_waves(os.path.join(FOLDER, "waves.exr"))
    write_sky(os.path.join(FOLDER, "sky.exr"))
