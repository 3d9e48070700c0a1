#!/usr/bin/env python3
"""make_ball.py FILE: the ball of the scenes in scenes/bench/ as PLY, radius 1, 32 x 16 facets."""

import math
import os
import sys

AROUND, DOWN = 32, 16


def main():
    points = [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0)]
    for i in range(1, DOWN):
        for k in range(AROUND):
            theta, phi = math.pi * i / DOWN, 2 * math.pi * k / AROUND
            points.append((math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi)))

    def at(i, k):
        return 2 + (i - 1) * AROUND + k % AROUND

    facets = [(0, at(1, k + 1), at(1, k)) for k in range(AROUND)]
    facets += [(1, at(DOWN - 1, k), at(DOWN - 1, k + 1)) for k in range(AROUND)]
    for i in range(1, DOWN - 1):
        for k in range(AROUND):
            facets += [(at(i, k), at(i, k + 1), at(i + 1, k + 1)), (at(i, k), at(i + 1, k + 1), at(i + 1, k))]
    lines = ["ply", "format ascii 1.0", "element vertex %d" % len(points)]
    lines += ["property float " + axis for axis in "xyz"]
    lines += ["element face %d" % len(facets), "property list uchar int vertex_indices", "end_header"]
    lines += ["%.9g %.9g %.9g" % p for p in points] + ["3 %d %d %d" % f for f in facets]
    with open(sys.argv[1] + ".tmp", "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")
    os.replace(sys.argv[1] + ".tmp", sys.argv[1])


if __name__ == "__main__":
    main()
