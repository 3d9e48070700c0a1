"""What isn't a matter of light: warnings, exit codes, the add-on's operator and its render engine."""

import io
import math
import os
import re
import subprocess
import sys

import brume_export
import scenes
import unmapped

EXPORT = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "apps", "blender",
                      "export.py")


def _parses(renderer, path):
    run = subprocess.run([renderer, "info", path], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    return "" if run.returncode == 0 else "render-cli info exits %d: %s" % (
        run.returncode, run.stdout.decode(errors="replace").strip())


def warnings(folder, renderer):
    """Each thing that doesn't map has its line, once, on the stream and in the file; nothing else has."""
    unmapped.build()
    stream, path = io.StringIO(), os.path.join(folder, "unmapped.xml")
    brume_export.export_scene(path, report=brume_export.Report(stream))
    said = stream.getvalue().splitlines()
    with open(path, encoding="utf-8") as file:
        comment = file.read().split("-->")[0]
    for expected in unmapped.EXPECTED:
        count = sum(line.startswith("warning: " + expected) for line in said)
        if count != 1:
            yield "%d lines of warning say \"%s\"" % (count, expected)
    for line in said:
        if not any(line.startswith("warning: " + expected) for expected in unmapped.EXPECTED):
            yield "unexpected: " + line
        if line.replace("--", "- -") not in comment:
            yield "not in the file's comment: " + line
    yield _parses(renderer, path)


def command_line(bpy, folder, renderer):
    """export.py as a program: exit codes, and that it writes the same as the add-on."""
    blend, camless = os.path.join(folder, "instances.blend"), os.path.join(folder, "camless.blend")
    scenes.instances()
    bpy.ops.wm.save_as_mainfile(filepath=blend, check_existing=False)
    bpy.context.scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=camless, check_existing=False)
    unmapped.build()
    strict = os.path.join(folder, "unmapped.blend")
    bpy.ops.wm.save_as_mainfile(filepath=strict, check_existing=False)
    out = os.path.join(folder, "command.xml")
    for arguments, code, words in (
            ([blend, out], 0, ""), ([blend, out, "--strict"], 0, ""), ([strict, out, "--strict"], 3, "warning: "),
            ([camless, out], 3, "export.py: the scene has no camera"), ([blend, out, "--scene", "none"], 2, "no scene none"),
            ([blend], 2, "usage: "), (["/nowhere.blend", out], 3, "export.py: "),
            ([blend, "/proc/nowhere/out.xml"], 6, "export.py: "), ([blend, out], 0, "")):
        run = subprocess.run([sys.executable, EXPORT] + arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             check=False, timeout=300)
        error = run.stderr.decode(errors="replace")
        if run.returncode != code or words not in error:
            yield "export.py %s exits %d, not %d: %s" % (" ".join(arguments), run.returncode, code, error)
    scenes.instances()
    again = os.path.join(folder, "operator.xml")
    if bpy.ops.export_scene.brume(filepath=again) != {"FINISHED"}:
        yield "the export operator failed"
    texts = [open(path, encoding="utf-8").read().replace(name, "X") for path, name in
             ((out, "command-files"), (again, "operator-files"))]
    if texts[0] != texts[1]:
        yield "the add-on's operator and the command line write different files"
    yield _parses(renderer, out)


def engine(bpy, numpy, folder, renderer):
    """A render with the engine is render-cli's picture of the exported scene."""
    from check_blender import read_exr
    os.environ["BRUME_RENDER_CLI"] = renderer
    scenes.instances()
    scene = bpy.context.scene
    scene.cycles.samples = 2
    path, ours = os.path.join(folder, "engine.exr"), os.path.join(folder, "engine-ours.exr")
    brume_export.export_scene(os.path.join(folder, "engine.xml"))
    scene.render.engine, scene.render.filepath = "BRUME", path
    bpy.ops.render.render(write_still=True)
    subprocess.run([renderer, os.path.join(folder, "engine.xml"), "-o", ours, "-q"], check=True)
    a, b = read_exr(numpy, path), read_exr(numpy, ours)
    if a.shape != b.shape or not numpy.array_equal(a, b) or not a.mean() > 0:
        yield "the engine's picture isn't render-cli's"


def linear_falloff(folder):
    """With --spot-falloff linear there is no gobo, and the spot's flux is Blender's: here by sums over the cosine."""
    scenes.spot_in_fog()
    path, stream = os.path.join(folder, "linear.xml"), io.StringIO()
    brume_export.export_scene(path, "linear", brume_export.Report(stream))
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if "<texture" in text or stream.getvalue().count("linear in the angle") != 1:
        yield "a gobo, or no word of what is lost: " + stream.getvalue()
    cutoff, beam = (math.radians(float(re.search('name="%s" value="([^"]*)"' % name, text).group(1)))
                    for name in ("cutoff_angle", "beam_width"))
    edge, steps, ours, blenders = math.cos(math.radians(17)), 100000, 0.0, 0.0
    for i in range(steps):
        cosine = edge + (1 - edge) * (i + 0.5) / steps
        x = min((cosine - edge) / ((1 - edge) * 0.6), 1)
        blenders += x * x * (3 - 2 * x)
        ours += min(max((cutoff - math.acos(cosine)) / (cutoff - beam), 0), 1)
    if abs(ours / blenders - 1) > 1e-3 or abs(cutoff - math.radians(17)) > 1e-5:
        yield "the linear spot's flux is %.5f of Blender's" % (ours / blenders)


def run(bpy, numpy, folder, renderer):
    """How many things did not hold; each is printed."""
    failed = 0
    checks = [("warnings", warnings(folder, renderer)), ("command line", command_line(bpy, folder, renderer)),
              ("linear falloff", linear_falloff(folder)), ("engine", engine(bpy, numpy, folder, renderer))]
    for name, problems in checks:
        found = [problem for problem in problems if problem]
        for problem in found:
            print("FAILED: %s: %s" % (name, problem))
        if not found:
            print("%s: as expected" % name, flush=True)
        failed += len(found)
    return failed
