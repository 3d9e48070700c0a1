#!/usr/bin/env python3
"""How time and memory grow with a scene: triangles, lights, pixels, samples, depth.

    bench_growth.py BUILD [--full] [--only TEXT] [--out FOLDER] [--plant]

Each series is rendered by render-cli with one number changed. Told is, for every step, its processor time, the peak of
memory, and what memory has grown by since the first step over what the bytes on the device have (with PoCL these are
part of it: 1 would be no copy at all). The slope in logarithms, 1 for in proportion, is of what comes on top of the
first step, from where that is as much again. Prints tables, writes growth.md, growth.json and, where there is gnuplot,
growth.svg. --full: up to 10 million triangles, 10000 lights and 8192² pixels.

Exit status 1: something grows faster than n log n, or triangles need more than three times the device's bytes. With
--plant times and memory are said to grow by another square root of n.
"""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)

import cli_run
import growth_scenes

LIMIT = 1.15   # slope of n log n over a decade or two, and what noise adds
MEMORY = 3     # times the bytes on the device


class Series:
    """Steps of one number n. run(n, folder) -> (scene, arguments, parameters); parts: what is timed besides the whole,
    as stats name it."""

    def __init__(self, name, steps, more, run, parts=(), memory=False):
        self.name, self.steps, self.more, self.run, self.parts, self.memory = name, steps, more, run, parts, memory


def terrain(n, folder):
    return growth_scenes.terrain(folder, n), ["--spp", "1"], {}


def lights(n, folder):
    return growth_scenes.lights(folder, n), ["--spp", "4"], {}


def pixels(n, _folder):
    side = str(round(math.sqrt(n)))
    return os.path.join(ROOT, "scenes/bench/area-light.xml"), ["--spp", "1"], {"width": side, "height": side}


def samples(n, _folder):
    return os.path.join(ROOT, "scenes/bench/area-light.xml"), ["--spp", str(n)], {"width": "64", "height": "64"}


def depth(n, _folder):
    return os.path.join(ROOT, "scenes/bench/open-beam.xml"), ["--spp", "8"], {
        "width": "64", "height": "64", "depth": str(n), "albedo": "1", "sigma_t": "2"}


SERIES = [
    Series("triangles", [1000, 10000, 100000, 1000000], [10000000], terrain,
           ["load_seconds", "bvh_seconds", "upload_seconds", "render_seconds"], True),
    Series("lights", [1, 10, 100, 1000], [10000], lights, ["bvh_seconds", "render_seconds"]),
    Series("pixels", [64 ** 2, 256 ** 2, 1024 ** 2, 2048 ** 2], [4096 ** 2, 8192 ** 2], pixels,
           ["render_seconds", "write_seconds"]),
    Series("samples", [16, 64, 256, 1024], [4096], samples, ["render_seconds"]),
    Series("depth", [2, 4, 8, 16, 32], [64, 128], depth, ["render_seconds"]),
]


def slope(points):
    """Of (n, value) without the first value, in logarithms; None if it never doubles that, twice."""
    first = points[0][1]
    points = [(math.log(n), math.log(t - first)) for n, t in points[1:] if t > 2 * first]
    if len(points) < 2:
        return None
    mx, my = (sum(p[k] for p in points) / len(points) for k in (0, 1))
    return sum((x - mx) * (y - my) for x, y in points) / sum((x - mx) ** 2 for x, _ in points)


def measure(renderer, series, steps, environment, plant):
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for n in steps:
            scene, arguments, parameters = series.run(n, folder)
            arguments = arguments + ["--adaptive", "off"]
            cli_run.render(renderer, scene, ["--spp", "1", "--crop", "0,16,0,16"], parameters, environment)  # program
            run = cli_run.render(renderer, scene, arguments, parameters, environment)
            row = {"n": n, "cpu_seconds": run.cpu, "peak": run.peak, "device": run.stats["device_bytes"]}
            row.update({part: run.stats[part] for part in series.parts})
            if plant:
                row["cpu_seconds"] *= (n / steps[0]) ** 0.5
                row["peak"] *= (n / steps[0]) ** 0.5
            rows.append(row)
            print("  %s %d: %.2f s, %.0f MiB" % (series.name, n, run.cpu, run.peak / 2 ** 20), file=sys.stderr,
                  flush=True)
    return rows


def copies(first, row):
    """What memory has grown by, over what the bytes on the device have."""
    grown = row["device"] - first["device"]
    return (row["peak"] - first["peak"]) / grown if grown > 2 ** 20 else float("nan")


def table(series, rows, slopes):
    names = ["cpu_seconds", *series.parts]
    lines = ["| %s | %s | peak MiB | device MiB | growth ÷ |" % (
        series.name, " | ".join(name.replace("_", " ") for name in names)),
             "|--:|%s--:|--:|--:|" % ("--:|" * len(names))]
    for r in rows:
        lines.append("| %d | %s | %.0f | %.1f | %.2f |" % (
            r["n"], " | ".join("%.3g" % r[name] for name in names), r["peak"] / 2 ** 20, r["device"] / 2 ** 20,
            copies(rows[0], r)))
    lines.append("| *slope* | %s |  |  |  |" % " | ".join(
        "%.2f" % slopes[name] if slopes[name] is not None else "-" for name in names))
    return "\n".join(lines)


def plot(out, results):
    """Time against n, each series over its largest n."""
    if not shutil.which("gnuplot"):
        return
    text = ["set terminal svg size 720,480 font 'DejaVu Sans,13'", "set output '%s'" % os.path.join(out, "growth.svg"),
            "set logscale xy", "set key left top", "set xlabel 'share of the largest'",
            "set ylabel 'processor seconds'",
            "set format x '10^{%T}'", "set format y '10^{%T}'", "set grid"]
    for i, (name, rows) in enumerate(results):
        text.append("$d%d << EOD" % i)
        text += ["%g %g" % (r["n"] / rows[-1]["n"], r["cpu_seconds"]) for r in rows] + ["EOD"]
    text.append("plot " + ", ".join("$d%d with linespoints lw 2 title '%s, to %d'" % (i, name, rows[-1]["n"])
                                    for i, (name, rows) in enumerate(results)))
    subprocess.run(["gnuplot"], input="\n".join(text) + "\n", universal_newlines=True, check=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--only", default="", metavar="TEXT", help="series whose name contains it")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "bench"))
    parser.add_argument("--plant", action="store_true")
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    renderer = os.path.join(os.path.abspath(options.build), "render-cli")
    result, bad, plotted, text = {"series": {}, "slopes": {}}, [], [], []
    with tempfile.TemporaryDirectory() as cache:
        environment = {"BRUME_CACHE_DIR": cache}
        for series in SERIES:
            if options.only not in series.name:
                continue
            steps = series.steps + (series.more if options.full else [])
            rows = measure(renderer, series, steps, environment, options.plant)
            names = ["cpu_seconds", *series.parts]
            slopes = {name: slope([(r["n"], r[name]) for r in rows]) for name in names}
            slopes["peak"] = slope([(r["n"], r["peak"]) for r in rows])
            bad += ["%s: %s grows as n^%.2f" % (series.name, name, value) for name, value in slopes.items()
                    if name in ("cpu_seconds", "peak") and value is not None and value > LIMIT]
            if series.memory and copies(rows[0], rows[-1]) > MEMORY:
                bad.append("%s: %.1f times the device's bytes" % (series.name, copies(rows[0], rows[-1])))
            result["series"][series.name], result["slopes"][series.name] = rows, slopes
            plotted.append((series.name, rows))
            text.append(table(series, rows, slopes))
            print("\n" + text[-1] + "\n", flush=True)
    plot(options.out, plotted)
    text += ["- " + line for line in bad]
    print("\n".join(bad) or "Nothing grows faster than n log n.")
    with open(os.path.join(options.out, "growth.md"), "w", encoding="utf-8") as file:
        file.write("\n\n".join(text) + "\n")
    with open(os.path.join(options.out, "growth.json"), "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
