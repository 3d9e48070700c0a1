#!/usr/bin/env python3
"""This tree against an earlier commit, in one run: is it slower?

    bench_quick.py BUILD BASE [--rounds N] [--only TEXT] [--plant]

BASE is built in BUILD/bench/base/COMMIT, once. Both render this tree's scenes in turns, each with its own cache of
programs, the same number of samples; told are ratios, this tree over BASE, medians over the rounds with the least and
the greatest: of processor time (less that of a single sample, so of rendering), of the error that the picture tells
of itself, and of memory at its peak. With --plant this tree renders a quarter more samples than it is charged for.

Exit status 0: no slower; 1: some scene takes more than 1.1 times as long, and in all rounds but one at least 1.03
times; 2: BASE can't be built.
"""

import argparse
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)

import cli_run

SECONDS = 0.8  # of rendering, of all processors, about what a run takes

SCENES = [
    ("open beam, once", "bench/open-beam", {"depth": "2"}),
    ("three spots, once", "bench/three-spots", {"depth": "2"}),
    ("three spots, often", "bench/three-spots", {"depth": "8"}),
    ("area light, no fog", "bench/area-light", {}),
    ("environment in fog", "ladder/environment-fog", {"width": "128", "height": "80"}),
    ("glass in fog", "glass-in-fog", {"width": "128", "height": "128"}),
]


def fail(text):
    print("bench-quick: " + text, file=sys.stderr)
    sys.exit(2)


def git(*arguments):
    run = subprocess.run(["git", "-C", ROOT, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False,
                         universal_newlines=True)
    if run.returncode:
        fail(run.stderr.strip())
    return run.stdout.strip()


def build_base(folder, name):
    """render-cli of that commit."""
    commit = git("rev-parse", "--verify", name + "^{commit}")
    base = os.path.join(folder, "base", commit[:12])
    renderer = os.path.join(base, "build", "render-cli")
    if not os.path.exists(renderer):
        os.makedirs(base, exist_ok=True)
        print("bench-quick: building %s in %s" % (name, base), file=sys.stderr, flush=True)
        archive = subprocess.Popen(["git", "-C", ROOT, "archive", commit], stdout=subprocess.PIPE)
        subprocess.run(["tar", "-x", "-C", base], stdin=archive.stdout, check=True)
        archive.stdout.close()
        if archive.wait():
            fail("no archive of " + commit)
        environment = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
        made = subprocess.run(["make", "-s", "-j2", "build/render-cli"], cwd=base, env=environment, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
        if made.returncode:
            fail("%s does not build:\n%s" % (commit, made.stdout[-2000:]))
    return renderer, commit[:12]


class Side:
    def __init__(self, renderer, cache, surplus):
        self.renderer, self.environment, self.surplus = renderer, {"BRUME_CACHE_DIR": cache}, surplus

    def render(self, scene, parameters, samples):
        # One width, asked for: it is then waited for, instead of a narrow program's beginning.
        return cli_run.render(self.renderer, os.path.join(ROOT, "scenes", scene + ".xml"),
                              ["--spp", str(int(samples * self.surplus)), "--adaptive", "off", "--lanes", self.lanes],
                              parameters, self.environment)


def median(values):
    values = sorted(values)
    return (values[(len(values) - 1) // 2] + values[len(values) // 2]) / 2


def compare(ours, theirs, scene, parameters, rounds):
    """Ratios of time, round by round, of error and of memory."""
    fixed = {}
    for side in (ours, theirs):
        side.render(scene, parameters, 4)  # builds its program, and keeps it
        fixed[side] = min(side.render(scene, parameters, 1).cpu for _ in range(2))
    samples = 4
    while samples < 4096 and theirs.render(scene, parameters, samples).cpu - fixed[theirs] < SECONDS / 2:
        samples *= 2
    times, errors, memory = [], [], []
    for i in range(rounds):
        runs = {}
        for side in (ours, theirs) if i % 2 else (theirs, ours):
            runs[side] = side.render(scene, parameters, samples)
        times.append((runs[ours].cpu - fixed[ours]) / (runs[theirs].cpu - fixed[theirs]))
        memory.append(runs[ours].peak / runs[theirs].peak)
        a, b = runs[ours].stats.get("relmse"), runs[theirs].stats.get("relmse")
        errors.append(a / b if a and b else float("nan"))
    return samples, times, median(errors), median(memory)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("base")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="", metavar="TEXT")
    parser.add_argument("--plant", action="store_true")
    options = parser.parse_args()
    folder = os.path.join(os.path.abspath(options.build), "bench")
    renderer, commit = build_base(folder, options.base)
    slower = False
    with tempfile.TemporaryDirectory() as caches:
        ours = Side(os.path.join(os.path.abspath(options.build), "render-cli"), os.path.join(caches, "ours"),
                    1.25 if options.plant else 1)
        theirs = Side(renderer, os.path.join(caches, "theirs"), 1)
        print("| this tree ÷ %s | time | from | to | relMSE | memory | samples |" % commit)
        print("|---|--:|--:|--:|--:|--:|--:|")
        for name, scene, parameters in SCENES:
            if options.only not in name:
                continue
            try:
                ours.lanes = theirs.lanes = str(cli_run.render(
                    ours.renderer, os.path.join(ROOT, "scenes", scene + ".xml"), ["--spp", "1"], parameters,
                    ours.environment).stats["lanes"])
                samples, times, error, memory = compare(ours, theirs, scene, parameters, options.rounds)
            except RuntimeError as failure:
                print("| %s | %s |" % (name, failure))
                slower = True
                continue
            bad = median(times) > 1.1 and sum(t > 1.03 for t in times) >= max(1, options.rounds - 1)
            slower |= bad
            print("| %s | %.3f%s | %.3f | %.3f | %.3f | %.3f | %d |" % (
                name, median(times), " **slower**" if bad else "", min(times), max(times), error, memory, samples),
                flush=True)
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
