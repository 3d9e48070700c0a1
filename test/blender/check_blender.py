#!/usr/bin/env python3
"""The Blender exporter, held against Cycles: scenes made by script are exported, rendered with render-cli and with
Cycles, and the pictures compared.

    check_blender.py BUILD [--only TEXT] [--no-plants] [--seeds N]

Both renderers run each scene with several seeds; the spread over the seeds gives the error of a mean. A scene passes if

 - no block of 16 x 16 pixels differs, in any channel, by more than 2 % of its value, at 99.9 % confidence (Welch's
   t-test per block and channel, with Sidak's correction for their number: test/crosscheck/crosscheck.py);
 - the mean of the picture differs by less than 2 % in every channel, and is known to 0.6 %.

Then errors are planted in the exported file (a power off by pi, a missing edge of a beam, a turned map ...), and each must
make the comparison fail. Besides: what doesn't map is said once each, the command line's exit codes, the render engine.

Pictures of both, side by side with their difference, go to BUILD/blender/pictures: to be looked at. Exit status 0: all
held; 1: something didn't; 77: Blender's module isn't to be had here.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.dont_write_bytecode = True
sys.path[:0] = [HERE, os.path.join(ROOT, "apps", "blender"), os.path.join(ROOT, "test", "crosscheck")]

import crosscheck

crosscheck.TOLERANCE, crosscheck.MEAN_LIMIT, crosscheck.MEAN_SIGMA = 0.02, 0.02, 0.006
BLOCK, MARGIN = 16, 0

# What is done to a scene file, for the comparison to notice.
PLANTS = {
    "spot_in_fog": {
        "power off by pi": lambda xml: scale(xml, "intensity", 3.14159265),
        "beam without its soft edge": lambda xml: re.sub(r'<texture type="bitmap" name="texture">.*?</texture>', "", xml,
                                                         flags=re.S),
        "fog that scatters backwards": lambda xml: xml.replace('name="g" value="0.3', 'name="g" value="-0.3')},
    "volume_box": {
        "area light of P / 4 A": lambda xml: scale(xml, "radiance", 0.785398),
        "isotropic fog": lambda xml: xml.replace('name="g" value="0.5"', 'name="g" value="0"')},
    "sun_and_sky": {
        "map not turned": lambda xml: re.sub(r'(type="envmap".*?<matrix value=")[^"]*', r"\g<1>0 0 1 0 1 0 0 0 0 1 0 0 0 0 0 1",
                                             xml, flags=re.S),
        "texture upside down": lambda xml: re.sub(r'(<transform name="to_uv">\s*<matrix value=")[^"]*',
                                                  r"\g<1>2 0 0 0 0 1.5 0 0 0 0 1 0 0 0 0 1", xml),
        "lens not shifted": lambda xml: re.sub(r'(name="crop_offset_.") value="\d+"', r'\1 value="0"', xml)},
    "instances": {
        "sheet that shines to one side": lambda xml: drop_shapes(xml, "glow-back"),
        "an instance is missing": lambda xml: drop_shapes(xml, "mirrored")},
    "nested": {
        "eye not in its volume": lambda xml: re.sub(r'(</transform>\s*)<ref id="medium-\d+" ?/>(\s*<sampler)', r"\1\2", xml),
        "volume without emission": lambda xml: re.sub(r'<rgb name="emission"[^>]*>', "", xml),
        "hard spot's power off by pi": lambda xml: scale(xml, "intensity", 1 / 3.14159265)},
}


def scale(xml, name, factor):
    def times(found):
        return found.group(1) + ", ".join("%.9g" % (factor * float(x)) for x in found.group(2).split(",")) + '"'
    return re.sub(r'(name="%s" value=")([^"]*)"' % name, times, xml)


def drop_shapes(xml, text):
    return "".join(part for part in re.split(r"(?<=</shape>)", xml) if text not in part or "</shape>" not in part)


def enter_environment(folder):
    """Continues in a virtual environment with the packages of requirements.txt, made the first time."""
    venv = os.path.join(folder, "venv")
    python = os.path.join(venv, "bin", "python")
    wanted = open(os.path.join(HERE, "requirements.txt"), encoding="ascii").read()
    stamp = os.path.join(venv, "requirements.txt")
    base = shutil.which("python3.11") or (sys.executable if sys.version_info[:2] == (3, 11) else None)
    if base is None:
        skip("Blender's module needs Python 3.11")
    if not os.path.exists(stamp) or open(stamp, encoding="ascii").read() != wanted:
        print("installing Blender's module for Python into", venv, flush=True)
        try:
            subprocess.run([base, "-m", "venv", venv], check=True)
            subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "-r",
                            os.path.join(HERE, "requirements.txt")], check=True)
        except (OSError, subprocess.CalledProcessError):
            skip("no virtual environment (Debian: python3-venv), or no packages from PyPI")
        with open(stamp, "w", encoding="ascii") as file:
            file.write(wanted)
    if os.path.realpath(sys.prefix) != os.path.realpath(venv):
        os.execv(python, [python, os.path.abspath(__file__)] + sys.argv[1:])


def skip(why):
    print("check-blender: skipped: " + why, file=sys.stderr)
    sys.exit(77)


def read_exr(numpy, path):
    import OpenEXR
    with OpenEXR.File(path, separate_channels=True) as file:
        channels = file.channels()
        return numpy.stack([numpy.array(channels[name].pixels, dtype=numpy.float32) for name in "RGB"], -1)


class Comparison:
    """One scene: exported, rendered by both."""

    def __init__(self, numpy, bpy, name, seeds, folder, renderer):
        import brume_export
        import scenes
        self.numpy, self.bpy, self.name, self.seeds, self.folder, self.renderer = (
            numpy, bpy, name, seeds, folder, renderer)
        build, self.reference_samples, self.samples = scenes.COMPARED[name]
        build()
        self.xml = os.path.join(folder, name + ".xml")
        report = brume_export.export_scene(self.xml)
        self.warnings = report.warnings
        self.block, self.margin = BLOCK, MARGIN

    def cycles(self):
        scene = self.bpy.context.scene
        scene.cycles.samples = self.reference_samples
        images = []
        for seed in range(self.seeds):
            scene.cycles.seed = seed
            scene.render.filepath = os.path.join(self.folder, "cycles.exr")
            self.bpy.ops.render.render(write_still=True)
            images.append(read_exr(self.numpy, scene.render.filepath))
        return self.numpy.array(images)

    def ours(self, xml=None):
        images, path = [], os.path.join(self.folder, "ours.exr")
        for seed in range(self.seeds):
            run = subprocess.run([self.renderer, xml or self.xml, "-o", path, "-q", "--spp", str(self.samples), "--seed",
                                  str(100 + seed)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
            if run.returncode:
                raise RuntimeError("render-cli exits %d: %s" % (run.returncode, run.stdout.decode(errors="replace")))
            images.append(read_exr(self.numpy, path))
        return self.numpy.array(images)

    def planted(self, change):
        with open(self.xml, encoding="utf-8") as file:
            text = file.read()
        changed = change(text)
        if changed == text:
            raise RuntimeError("the error could not be planted: the scene file has changed")
        path = os.path.join(self.folder, self.name + "-planted.xml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(changed)
        # The pictures' folder is named after the scene file, but the file names it by itself.
        return self.ours(path)

    def picture(self, ours, reference):
        numpy = self.numpy
        a, b = ours.mean(0), reference.mean(0)
        exposed = numpy.concatenate([a, b], 1) * 0.4 / b.mean()
        difference = 0.5 + (a - b) / numpy.maximum(0.2 * abs(b), 0.02 * b.mean()) * 0.5
        values = numpy.concatenate([numpy.clip(exposed, 0, 1) ** (1 / 2.2), numpy.clip(difference, 0, 1)], 1)
        image = self.bpy.data.images.new("compared", values.shape[1], values.shape[0])
        rgba = numpy.ones(values.shape[:2] + (4,), dtype=numpy.float32)
        rgba[..., :3] = values[::-1]
        image.pixels.foreach_set(rgba.ravel())
        image.file_format = "PNG"
        image.filepath_raw = os.path.join(self.folder, "pictures", self.name + ".png")
        image.save()


def show(name, result, seconds):
    if "p" not in result:
        print("%-42s %s" % (name, result["verdict"]), flush=True)
        return
    print("%-42s %10.5g %10.5g %8.3f %7.3f %9.2g %4d,%4d  %5.1f  %s" % (
        name, result["ours"], result["reference"], 100 * result["difference"], 100 * result["sigma"], result["p"],
        *result["where"], seconds, result["verdict"]), flush=True)


def compare_scenes(numpy, bpy, options, folder, renderer):
    """How many things did not hold."""
    import scenes
    failed = 0
    os.makedirs(os.path.join(folder, "pictures"), exist_ok=True)
    print("%-42s %10s %10s %8s %7s %9s %9s  %5s  %s" % (
        "scene", "ours", "Cycles", "diff %", "sigma %", "worst p", "at pixel", "s", "verdict"))
    for name in scenes.COMPARED:
        if options.only not in name:
            continue
        start = time.monotonic()
        one = Comparison(numpy, bpy, name, options.seeds, folder, renderer)
        ours, reference = one.ours(), one.cycles()
        result = crosscheck.compare(numpy, one, ours, reference)
        one.picture(ours, reference)
        if one.warnings:
            result["verdict"] += " WARNED: " + "; ".join(one.warnings)
        failed += not result["passed"] or bool(one.warnings)
        show(name, result, time.monotonic() - start)
        for planted, change in {} if options.no_plants else PLANTS[name].items():
            start = time.monotonic()
            result = crosscheck.compare(numpy, one, one.planted(change), reference)
            # An error counts as found by what it did to the picture, not by the noise it brought.
            found = "MEAN" in result["verdict"] or "BLOCKS" in result["verdict"]
            result["verdict"] = "found: " + result["verdict"] if found else "NOT FOUND"
            failed += not found
            show("  planted: " + planted, result, time.monotonic() - start)
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--only", default="", metavar="TEXT", help="scenes whose name contains TEXT")
    parser.add_argument("--no-plants", action="store_true", help="without planted errors")
    parser.add_argument("--seeds", type=int, default=8, help="of each renderer (8)")
    options = parser.parse_args()
    folder = os.path.join(os.path.abspath(options.build), "blender")
    os.makedirs(folder, exist_ok=True)
    enter_environment(folder)
    try:
        import bpy
    except ImportError as error:
        skip("Blender's module doesn't load: %s" % error)
    import numpy
    import brume_export
    import check_use
    brume_export.register()
    renderer = os.path.join(os.path.abspath(options.build), "render-cli")
    failed = check_use.run(bpy, numpy, folder, renderer)
    failed += compare_scenes(numpy, bpy, options, folder, renderer)
    print("check-blender: %s" % ("all held" if not failed else "%d FAILED" % failed))
    return 1 if failed else 0


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # Blender's module can wait for its threads forever as it is taken down
