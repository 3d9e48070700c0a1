"""Pictures: copies of Blender's, and computed ones."""

import os
import re
import shutil

import bpy
import numpy


def safe_name(name):
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name) or "unnamed"


class Folder:
    """The folder beside the scene file that pictures and meshes go to. Names are given relative to the scene file."""

    def __init__(self, scene_path):
        self.base = os.path.dirname(os.path.abspath(scene_path))
        self.name = safe_name(os.path.splitext(os.path.basename(scene_path))[0]) + "-files"
        self._taken = set()

    def path(self, relative):
        return os.path.join(self.base, relative)

    def new(self, name, extension):
        """A name in the folder that nothing else has, relative to the scene file."""
        os.makedirs(self.path(self.name), exist_ok=True)
        stem, count = safe_name(name), 1
        candidate = stem
        while (candidate + extension).lower() in self._taken:
            count += 1
            candidate = "%s-%d" % (stem, count)
        self._taken.add((candidate + extension).lower())
        return self.name + "/" + candidate + extension


def pixels(image):
    """height x width x 3 numbers as Blender stores them, row 0 at the bottom; None if there are none."""
    width, height = image.size
    if width * height == 0:
        return None
    values = numpy.empty(width * height * image.channels, dtype=numpy.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)
    return values[:, :, :3] if image.channels >= 3 else numpy.repeat(values[:, :, :1], 3, axis=2)


def write_exr(path, rows):
    """`rows`: height x width x 3 linear numbers, row 0 at the bottom, as Blender has them."""
    height, width = rows.shape[:2]
    image = bpy.data.images.new("brume", width, height, float_buffer=True, is_data=True)
    try:
        rgba = numpy.ones((height, width, 4), dtype=numpy.float32)
        rgba[:, :, :3] = rows
        image.pixels.foreach_set(rgba.ravel())
        image.file_format = "OPEN_EXR"
        image.filepath_raw = path
        image.save()
    finally:
        bpy.data.images.remove(image)


def is_linear(image):
    return image.is_float or image.colorspace_settings.name in ("Non-Color", "Raw", "Linear Rec.709", "Linear")


def export(folder, image):
    """A copy of `image` that render-cli reads; its name relative to the scene file, None if it has no pixels."""
    source = bpy.path.abspath(image.filepath, library=image.library) if image.filepath else ""
    extension = os.path.splitext(source)[1].lower()
    if (image.source == "FILE" and extension in (".png", ".jpg", ".jpeg") and not image.packed_file
            and not image.is_dirty and os.path.isfile(source)):
        name = folder.new(os.path.splitext(image.name)[0], extension)
        shutil.copyfile(source, folder.path(name))
        return name
    values = pixels(image)
    if values is None:
        return None
    if image.is_float:
        name = folder.new(image.name, ".exr")
        write_exr(folder.path(name), values)
        return name
    name = folder.new(image.name, ".png")
    height, width = values.shape[:2]
    copy = bpy.data.images.new("brume", width, height, alpha=False)
    try:
        rgba = numpy.ones((height, width, 4), dtype=numpy.float32)
        rgba[:, :, :3] = values
        copy.pixels.foreach_set(rgba.ravel())
        copy.file_format = "PNG"
        copy.filepath_raw = folder.path(name)
        copy.save()
    finally:
        bpy.data.images.remove(copy)
    return name
