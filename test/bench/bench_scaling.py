#!/usr/bin/env python3
"""What more cores are worth, and what it costs to render with several devices in the place of one.

    bench_scaling.py BUILD [--rounds N] [--seconds S] [--only TEXT] [--out FOLDER] [--plant]

Each scene is rendered on one core, on 2, 4 and so on up to all of them, and on all of them as two OpenCL devices, each
of half the cores, that share the picture; in turns, as often as there are rounds. Told are wall seconds of rendering
(without loading, compiling and writing), medians, and the efficiency: how much of the speed of so many single cores
is there, with the least and the greatest of the rounds. Prints a table, writes scaling.md and scaling.json. With
--plant the cores beyond the first are said to be there and are not.
"""

import argparse
import json
import os
import statistics
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)

import cli_run

GOAL = 0.95

SCENES = [
    ("open beam, once", "bench/open-beam", {"depth": "2"}),
    ("three spots, often", "bench/three-spots", {"depth": "8"}),
    ("area light, no fog", "bench/area-light", {}),
    ("environment in fog", "ladder/environment-fog", {"width": "128", "height": "80"}),
]


class Setup:
    """So many cores, as so many devices."""

    def __init__(self, cores, devices=1):
        self.cores, self.devices = cores, devices
        self.name = "%d core%s" % (cores, "" if cores == 1 else "s")
        if devices > 1:
            self.name += " as %d devices" % devices


def setups(count):
    steps, n = [], 1
    while n < count:
        steps.append(Setup(n))
        n *= 2
    steps.append(Setup(count))
    return steps + ([Setup(count, 2)] if count > 1 else [])


def render(renderer, scene, parameters, samples, setup, environment, plant):
    """Wall seconds of rendering. PoCL counts its threads by what it is told, not by what it may run on."""
    available = sorted(os.sched_getaffinity(0))
    used = available[:1 if plant else setup.cores]
    chosen = dict(environment, POCL_MAX_PTHREAD_COUNT=str(setup.cores))
    device = ["--device", "Portable/%d" % setup.devices] if setup.devices > 1 else ["--device", "Portable"]
    os.sched_setaffinity(0, used)
    try:
        run = cli_run.render(renderer, os.path.join(ROOT, "scenes", scene + ".xml"),
                             ["--spp", str(samples), *device], parameters, chosen)
    finally:
        os.sched_setaffinity(0, available)
    return run.stats["render_seconds"]


def samples_for(seconds, renderer, scene, parameters, environment):
    """A power of two that takes one core about so long; and both kinds of set-ups have their programs in the cache."""
    samples = 1
    while True:
        took = render(renderer, scene, parameters, samples, Setup(1), environment, False)
        if took >= seconds / 2 or samples >= 1 << 16:
            return samples
        samples *= 2 if took > seconds / 8 else 8


def measure(renderer, scene, parameters, options, environment):
    steps = setups(len(os.sched_getaffinity(0)))
    samples = samples_for(options.seconds, renderer, scene, parameters, environment)
    for step in steps:
        render(renderer, scene, parameters, 1, step, environment, False)
    seconds = {step.name: [] for step in steps}
    for _ in range(options.rounds):
        for step in steps:
            seconds[step.name].append(render(renderer, scene, parameters, samples, step, environment, options.plant))
    rows = []
    for step in steps:
        shares = sorted(one / (step.cores * own) for one, own in zip(seconds[steps[0].name], seconds[step.name]))
        rows.append({"setup": step.name, "cores": step.cores, "devices": step.devices, "samples": samples,
                     "seconds": statistics.median(seconds[step.name]), "efficiency": statistics.median(shares),
                     "least": shares[0], "greatest": shares[-1]})
    return rows


def table(result):
    lines = ["| scene | | samples | seconds | efficiency | least to greatest |", "|---|---|--:|--:|--:|--:|"]
    for name, rows in result.items():
        for row in rows:
            known = row["cores"] > 1
            lines.append("| %s | %s | %d | %.2f | %s | %s |" % (
                name, row["setup"], row["samples"], row["seconds"],
                "%.1f %%" % (100 * row["efficiency"]) if known else "",
                "%.1f to %.1f %%" % (100 * row["least"], 100 * row["greatest"]) if known else ""))
            name = ""
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4, help="of rendering on one core, about, for each run")
    parser.add_argument("--only", default="", metavar="TEXT", help="scenes whose name contains it")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "bench"))
    parser.add_argument("--plant", action="store_true")
    options = parser.parse_args()
    if len(os.sched_getaffinity(0)) < 2:
        print("bench-scaling: skipped: there is one core")
        return 0
    os.makedirs(options.out, exist_ok=True)
    renderer, result = os.path.join(os.path.abspath(options.build), "render-cli"), {}
    with tempfile.TemporaryDirectory() as cache:
        for name, scene, parameters in SCENES:
            if options.only in name:
                print("bench-scaling: " + name, file=sys.stderr, flush=True)
                result[name] = measure(renderer, scene, parameters, options, {"BRUME_CACHE_DIR": cache})
    text = table(result)
    shares = [(row["efficiency"], name, row["setup"]) for name, rows in result.items() for row in rows
              if row["cores"] > 1]
    worst = min(shares) if shares else (1, "none", "")
    text += "\n\nLeast: %.1f %%, %s, %s. The goal is %.0f %%: %s.\n" % (
        100 * worst[0], worst[1], worst[2], 100 * GOAL, "reached" if worst[0] >= GOAL else "missed")
    print(text)
    with open(os.path.join(options.out, "scaling.md"), "w", encoding="utf-8") as file:
        file.write(text)
    with open(os.path.join(options.out, "scaling.json"), "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
