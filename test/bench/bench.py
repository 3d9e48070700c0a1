#!/usr/bin/env python3
"""brume against other renderers: the same scenes on the same cores, in turns, each judged by its own long reference.

    bench.py BUILD [--quick] [--scenes TEXT,...] [--peers NAME,...] [--seconds S] [--clock wall|cpu] ...
    bench.py BUILD --install

Prints tables and writes them to OUT/bench.md, with everything measured in OUT/bench.json. Each renderer first tries its
modes for a moment; with the best it renders 1, 4, 16 ... samples a pixel until `--seconds` are over. Errors are relMSE,
without the worst 0.1 % of the pixels, against a reference of its own that is kept in BUILD/bench/references; what
they are relative to comes from brume's reference for everybody, the least noisy. From the times of the others what a
render costs besides its samples is taken off. Whoever's mean is more than 2 % off is not timed.

Exit status 0: measured; 1: nobody could be compared with; 2: wrong usage.
"""

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)


def venv_of(build):
    return os.path.join(build, "bench", "venv")


def install(build):
    """Each package by itself: one that can't be had is left out, with a word."""
    venv = venv_of(build)
    subprocess.run([sys.executable, "-m", "venv", venv], check=True)
    missing = []
    for line in open(os.path.join(HERE, "requirements.txt"), encoding="ascii"):
        package = line.split("#")[0].strip()
        if package and subprocess.run([os.path.join(venv, "bin", "python"), "-m", "pip", "install", "-q",
                                       "--disable-pip-version-check", package], check=False).returncode:
            missing.append(package)
    print("bench-peers: " + ("could not install " + ", ".join(missing) if missing else "everything is installed"))
    return 1 if missing else 0


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--install", action="store_true", help="the peers, into BUILD/bench/venv, and nothing else")
    parser.add_argument("--quick", action="store_true", help="1 s each, references of 10 s: some minutes, rough")
    parser.add_argument("--scenes", default="", metavar="TEXT,...", help="rows whose name contains one of these")
    parser.add_argument("--peers", default="mitsuba,cycles,luxcore", metavar="NAME,...")
    parser.add_argument("--seconds", type=float, metavar="S", help="the longest render (10)")
    parser.add_argument("--reference-seconds", type=float, metavar="S", help="of each reference (30)")
    parser.add_argument("--size", type=int, default=256, help="width and height (256)")
    parser.add_argument("--clock", choices=["wall", "cpu"], default="wall",
                        help="cpu: time of all processors over their number, where others use the machine, too")
    parser.add_argument("--cores", type=int, help="use so many (all)")
    parser.add_argument("--fresh", action="store_true", help="render references anew")
    parser.add_argument("--no-startup", action="store_true", help="leave out the time to the first picture")
    parser.add_argument("--plant", default="", metavar="NAME|NAME-noise",
                        help="that renderer's reference is 5 %% too bright, or its pictures noisier by 50 %%")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "bench"))
    options = parser.parse_args()
    options.seconds = options.seconds or (1 if options.quick else 10)
    options.reference_seconds = options.reference_seconds or (10 if options.quick else 30)
    return options


def start_up(renderer, row, build):
    """Seconds from the start of a process to a picture of one sample, written; the least of three, caches warm."""
    def once(folder):
        start = time.monotonic()
        if renderer.package is None:
            command = [os.path.join(build, "render-cli"), row.path, "--spp", "1", "-q", "-o",
                       os.path.join(folder, "picture.exr")]
            command += [word for item in row.parameters.items() for word in ("-D", "%s=%s" % item)]
            if subprocess.run(command, stdin=subprocess.DEVNULL, check=False).returncode:
                raise renderers.Failure("render-cli failed")
        else:
            worker = renderers.Worker(renderer, subprocess.DEVNULL)
            try:
                mode = (renderer.modes if row.fog else renderer.modes_without_fog)[0]
                worker.ask("load", row.path, mode, *("%s=%s" % item for item in row.parameters.items()))
                worker.ask("render", "1", "1", os.path.join(folder, "picture.raw"))
                seconds = time.monotonic() - start
            finally:
                worker.close()
            return seconds
        return time.monotonic() - start
    with tempfile.TemporaryDirectory() as folder:
        return min(once(folder), once(folder), once(folder))


def machine():
    model = platform.processor()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL, universal_newlines=True, check=False).stdout.strip()
    return {"processor": model, "cores_used": len(os.sched_getaffinity(0)), "system": platform.platform(),
            "date": datetime.date.today().isoformat(), "commit": commit, "load": os.getloadavg()}


def main():
    options = parse()
    build = os.path.abspath(options.build)
    if options.install:
        return install(build)
    venv = venv_of(build)
    python = os.path.join(venv, "bin", "python")
    if os.path.exists(python) and os.path.realpath(sys.prefix) != os.path.realpath(venv):
        os.execv(python, [python, os.path.abspath(__file__)] + sys.argv[1:])
    try:
        global renderers
        import renderers
        import contest
        import rows
        import tables
    except ImportError as error:
        print("bench: %s; make bench-peers installs it" % error, file=sys.stderr)
        return 1
    if options.cores:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:options.cores])
        os.environ["POCL_MAX_PTHREAD_COUNT"] = str(options.cores)
    options.cores = len(os.sched_getaffinity(0))

    folder = os.path.join(build, "bench")
    os.makedirs(options.out, exist_ok=True)
    taking_part = []
    for renderer in renderers.everyone(build):
        if renderer.name != "brume" and renderer.name not in options.peers.split(","):
            continue
        missing = renderer.missing()
        if missing:
            contest.complain("%s is left out: %s" % (renderer.name, missing))
        else:
            taking_part.append(renderer)
    chosen = [row.prepare(options.size) for row in rows.ROWS
              if any(text in row.name for text in options.scenes.split(","))]
    if not chosen or taking_part[0].name != "brume":
        contest.complain("there is nothing to measure")
        return 2

    start, results, startup = time.monotonic(), [], {}
    for row in chosen:
        contest.complain("%s (%.0f s so far)" % (row.name, time.monotonic() - start))
        try:
            contenders = contest.Contest(taking_part, row, options, folder,
                                         lambda text, row=row: contest.complain("%s: %s" % (row.name, text))).run()
        except renderers.Failure as failure:
            contest.complain("%s: nothing to compare with: %s" % (row.name, failure))
            continue
        results.append(tables.result(row, contenders, options.clock, options.seconds))
        print(summary(results[-1]), flush=True)
        write(options, taking_part, results, startup, time.monotonic() - start)
    for renderer in [] if options.no_startup else taking_part:
        try:
            startup[renderer.name] = start_up(renderer, chosen[0], build)
        except renderers.Failure as failure:
            contest.complain("start of %s: %s" % (renderer.name, failure))
    print("\n" + write(options, taking_part, results, startup, time.monotonic() - start))
    return 0 if any(r["ratios"] for r in results) else 1


def write(options, taking_part, results, startup, seconds):
    """bench.md and bench.json of what there is; returns the former."""
    import tables
    names, about = [renderer.name for renderer in taking_part], machine()
    text = ["%s, %d cores used, %s, commit %s; %s clock, %d² pixels, %.0f minutes." % (
        about["processor"], about["cores_used"], about["date"], about["commit"], options.clock, options.size,
        seconds / 60)]
    text += [tables.table(results, names, measure, options.seconds) for measure in tables.MEASURES]
    text.append(tables.speed_table(results, startup, names))
    text.append("*: extrapolated. ~: its own reference is off by more than ten times that; doubtful.")
    text += ["- %s %s: %s" % (r.name, getattr(r, "version", ""), r.settings) for r in taking_part]
    text = "\n\n".join(text[:-len(taking_part)]) + "\n\n" + "\n".join(text[-len(taking_part):]) + "\n"
    with open(os.path.join(options.out, "bench.md"), "w", encoding="utf-8") as file:
        file.write(text)
    with open(os.path.join(options.out, "bench.json"), "w", encoding="utf-8") as file:
        json.dump({"machine": about, "options": vars(options), "startup_seconds": startup,
                   "versions": {r.name: getattr(r, "version", None) for r in taking_part}, "rows": results},
                  file, indent=1)
    return text


def summary(result):
    """A line per renderer."""
    lines = [result["row"]]
    for name, e in result["renderers"].items():
        if "figures" not in e:
            lines.append("  %-8s %s" % (name, e["failure"]))
            continue
        cells = ["%s %.3g%s" % (measure, value[0], value[1]) for measure, value in e["figures"].items() if value[0]]
        lines.append("  %-8s %s; mean %.5g ± %.1g %%, reference %.1e; %s; %.2f M/s" % (
            name, " ".join(e["modes"]), e["mean"], 100 * e["mean_sigma"] / e["mean"], e["reference_error"],
            ", ".join(cells), e["samples_per_second"] / 1e6))
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
