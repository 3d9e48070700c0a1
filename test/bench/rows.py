"""The rows of `make bench`, and what each was meant to reach."""

import os

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.normpath(os.path.join(HERE, "..", "..", "scenes", "bench"))
BALL = os.path.normpath(os.path.join(HERE, "..", "..", "build", "meshes", "ball.ply"))


class Row:
    """A scene file with its depth. `goal`: a measure and the greatest ratio to the best peer in it."""

    def __init__(self, name, scene, depth, goal=None, fog=True):
        self.name, self.scene, self.depth, self.goal, self.fog = name, scene, depth, goal, fog

    def prepare(self, size):
        self.size = size
        self.path = os.path.join(SCENES, self.scene + ".xml")
        self.parameters = {"depth": str(self.depth), "width": str(size), "height": str(size)}
        self.files = [self.path, os.path.join(SCENES, "room.xml"), os.path.join(SCENES, "fog.xml"), BALL]
        return self


ROWS = [
    Row("open-beam single", "open-beam", 2, ("1e-3", 1 / 20)),
    Row("half-hidden single", "half-hidden", 2),
    Row("thin-fog single", "thin-fog", 2, ("1e-3", 1 / 20)),
    Row("three-spots single", "three-spots", 2, ("1e-3", 1 / 40)),
    Row("open-beam multiple", "open-beam", 8, ("error", 1 / 20)),
    Row("half-hidden multiple", "half-hidden", 8),
    Row("thin-fog multiple", "thin-fog", 8, ("1e-3", 1 / 10)),
    Row("three-spots multiple", "three-spots", 8, ("error", 1 / 20)),
    Row("area-light no fog", "area-light", 8, ("1e-3", 1 / 2.5), fog=False),
]
