"""Exports scenes from Blender to brume, and renders them with it.

As an add-on: File > Export > brume (.xml), and the render engine "brume". From the command line: ../export.py.
"""

bl_info = {
    "name": "brume",
    "author": "brume",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "File > Export > brume; Properties > Render > Render Engine",
    "description": "Light in fog: exports scenes for render-cli, and renders with it",
    "category": "Import-Export",
}

import os
import subprocess
import tempfile

import bpy
import numpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from .export import Exporter
from .report import ExportError, Report


class BrumeRenderEngine(bpy.types.RenderEngine):
    """Renders by way of a scene file and render-cli. Exporting is a render that stops at the file: only a render gets
    the scene as it renders, with the modifiers and the visibility that go for that."""

    bl_idname = "BRUME"
    bl_label = "brume"
    bl_use_shading_nodes_custom = False
    # Set while an export runs: {"path", "spot_falloff", "report", "error"}.
    task = None

    def render(self, depsgraph):
        task = BrumeRenderEngine.task
        if task is None:
            self._picture(depsgraph)
            return
        # Blender prints what is raised here and goes on: it is handed on by hand.
        try:
            Exporter(depsgraph, task["path"], task["report"], task["spot_falloff"]).run()
        except Exception as error:
            task["error"] = error

    def _picture(self, depsgraph):
        command = render_cli()
        with tempfile.TemporaryDirectory(prefix="brume-") as folder:
            scene, picture = os.path.join(folder, "scene.xml"), os.path.join(folder, "picture.exr")
            try:
                Exporter(depsgraph, scene, Report()).run()
            except ExportError as error:
                self.report({"ERROR"}, str(error))
                return
            self.update_stats("", "brume is rendering")
            log = os.path.join(folder, "log")
            try:
                with open(log, "w", encoding="utf-8") as messages:
                    # Blender's reader gives no pixels of a file with layers.
                    process = subprocess.Popen([command, scene, "-o", picture, "-q", "--layers", "none"],
                                               stdout=messages, stderr=messages)
            except OSError as error:
                self.report({"ERROR"}, "%s: %s" % (command, error))
                return
            self._wait(process)
            if process.returncode and not os.path.exists(picture):
                with open(log, encoding="utf-8", errors="replace") as messages:
                    self.report({"ERROR"}, "render-cli: " + messages.read().strip())
                return
            self._show(picture)

    def _show(self, picture):
        image = bpy.data.images.load(picture)
        try:
            image.colorspace_settings.is_data = True  # linear as it is
            width, height = image.size
            pixels = numpy.empty(width * height * 4, dtype=numpy.float32)
            image.pixels.foreach_get(pixels)
        finally:
            bpy.data.images.remove(image)
        result = self.begin_result(0, 0, width, height)
        result.layers[0].passes["Combined"].rect.foreach_set(pixels)
        self.end_result(result)

    def _wait(self, process):
        """Esc stops the render, which then writes what it has."""
        while True:
            try:
                process.wait(0.1)
                return
            except subprocess.TimeoutExpired:
                if self.test_break():
                    process.terminate()
                    process.wait()
                    return


def render_cli():
    """Where the add-on's settings, $BRUME_RENDER_CLI or the PATH say it is."""
    addon = bpy.context.preferences.addons.get(__package__)
    chosen = addon.preferences.render_cli if addon and addon.preferences else ""
    return chosen or os.environ.get("BRUME_RENDER_CLI") or "render-cli"


class BrumePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    render_cli: StringProperty(name="render-cli", subtype="FILE_PATH", description="The program that renders")

    def draw(self, context):
        self.layout.prop(self, "render_cli")


def export_scene(path, spot_falloff="exact", report=None, scene=None):
    """Exports a scene (the current one) as it would be rendered. Returns the Report; raises ExportError or OSError."""
    scene = scene or bpy.context.scene
    task = {"path": path, "spot_falloff": spot_falloff, "report": report or Report(), "error": None}
    if scene.camera is None:
        raise ExportError("the scene has no camera")
    # What costs time or writes files in a render has no part in an export.
    keep = {name: getattr(scene.render, name) for name in ("engine", "use_compositing", "use_sequencer")}
    try:
        scene.render.use_compositing = scene.render.use_sequencer = False
        scene.render.engine = BrumeRenderEngine.bl_idname
        BrumeRenderEngine.task = task
        bpy.ops.render.render(write_still=False, scene=scene.name)
    finally:
        BrumeRenderEngine.task = None
        for name, value in keep.items():
            setattr(scene.render, name, value)
    if task["error"]:
        raise task["error"]
    return task["report"]


class ExportBrume(bpy.types.Operator, ExportHelper):
    """Write the scene as a Mitsuba 3 file for brume's render-cli"""

    bl_idname = "export_scene.brume"
    bl_label = "Export brume"
    filename_ext = ".xml"
    filter_glob: StringProperty(default="*.xml", options={"HIDDEN"})
    spot_falloff: EnumProperty(name="Spot falloff", items=[
        ("exact", "Exact", "Blender's own, by a gobo"),
        ("linear", "Linear", "Mitsuba's, of the same flux: no texture, which renders faster")])

    def execute(self, context):
        try:
            done = export_scene(self.filepath, self.spot_falloff, scene=context.scene)
        except (ExportError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for line in done.warnings:
            self.report({"WARNING"}, line)
        return {"FINISHED"}


CLASSES = (BrumeRenderEngine, BrumePreferences, ExportBrume)


def _menu(self, context):
    self.layout.operator(ExportBrume.bl_idname, text="brume (.xml)")


def _panels():
    """Where Cycles' settings are shown, they are shown for this engine, too: it reads them."""
    return [panel for panel in bpy.types.Panel.__subclasses__() if "CYCLES" in getattr(panel, "COMPAT_ENGINES", ())]


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.TOPBAR_MT_file_export.append(_menu)
    for panel in _panels():
        panel.COMPAT_ENGINES.add(BrumeRenderEngine.bl_idname)


def unregister():
    for panel in _panels():
        panel.COMPAT_ENGINES.discard(BrumeRenderEngine.bl_idname)
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
