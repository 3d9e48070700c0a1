"""Scenes of a given size, for bench_growth.py."""

import array
import math
import os
import random

VIEW = """
    <sensor type="perspective">
        <float name="fov" value="60"/>
        <transform name="to_world">
            <lookat origin="0, 5, 11" target="0, 0, 1" up="0, 1, 0"/>
        </transform>
        <sampler type="independent"/>
        <film type="hdrfilm">
            <integer name="width" value="128"/>
            <integer name="height" value="128"/>
            <string name="pixel_format" value="rgb"/>
            <rfilter type="box"/>
        </film>
    </sensor>
"""


def _write(path, integrator, text):
    with open(path, "w", encoding="ascii") as file:
        file.write('<scene version="3.0.0">\n    <integrator type="%s">\n' % integrator +
                   '        <integer name="max_depth" value="4"/>\n    </integrator>\n' + VIEW + text + '</scene>\n')
    return path


def terrain(folder, triangles):
    """Hills of so many triangles, or the next number that a square net has, under a constant sky."""
    cells = round(math.sqrt(triangles / 2))
    mesh = os.path.join(folder, "terrain.ply")
    heights = [[0.6 * math.sin(1.1 * 20 * i / cells) + 0.05 * math.sin(90.0 * i / cells) for i in range(cells + 1)]]
    heights.append([math.cos(20.0 * i / cells) + 0.05 * math.cos(110.0 * i / cells) for i in range(cells + 1)])
    with open(mesh, "wb") as file:
        file.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                    "property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n" % (
                        (cells + 1) ** 2, 2 * cells ** 2)).encode())
        for j in range(cells + 1):
            row = array.array("f")
            for i in range(cells + 1):
                row.extend((20 * i / cells - 10, heights[0][i] * heights[1][j], 20 * j / cells - 10))
            file.write(row.tobytes())
        for j in range(cells):
            row = bytearray()
            corners = array.array("i", [0] * 3)
            for i in range(cells):
                a = j * (cells + 1) + i
                b = a + cells + 1
                for corners[0], corners[1], corners[2] in ((a, b, a + 1), (a + 1, b, b + 1)):
                    row.append(3)
                    row += corners.tobytes()
            file.write(row)
    return _write(os.path.join(folder, "terrain.xml"), "path", """
    <shape type="ply">
        <string name="filename" value="terrain.ply"/>
        <boolean name="face_normals" value="true"/>
    </shape>
    <emitter type="constant"/>
""")


def lights(folder, count):
    """A floor under so many spots, as bright together whatever their number."""
    place = random.Random(4)
    spots = "".join("""
    <emitter type="spot">
        <transform name="to_world">
            <lookat origin="{0:.4f}, 3, {1:.4f}" target="{0:.4f}, 0, {2:.4f}" up="1, 0, 0"/>
        </transform>
        <rgb name="intensity" value="{3:.6g}"/>
        <float name="cutoff_angle" value="20"/>
    </emitter>
""".format(place.uniform(-6, 6), z, z - 0.5, 100 / count) for z in (place.uniform(-6, 6) for _ in range(count)))
    return _write(os.path.join(folder, "lights.xml"), "path", """
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="10"/>
            <rotate x="1" angle="-90"/>
        </transform>
    </shape>
""" + spots)
