"""Who takes part in `make bench`, and how a process of each is talked to."""

import importlib.util
import os
import selectors
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))


class Failure(Exception):
    """What a worker replied, or that it didn't."""


class Renderer:
    """`modes` are what is best for it in one scene or another: a short pilot tells which. `settings` is what stands
    under the table."""

    def __init__(self, name, command, package, modes, modes_without_fog, settings):
        self.name, self.command, self.package, self.settings = name, command, package, settings
        self.modes, self.modes_without_fog = modes, modes_without_fog

    def missing(self):
        """Why it can't take part, or None."""
        if self.package:
            return None if importlib.util.find_spec(self.package) else (
                "PyPI's %s is not installed: make bench-peers" % self.package)
        return None if os.path.exists(self.command[0]) else "%s is not built" % self.command[0]


def everyone(build):
    def worker(name):
        return [sys.executable, os.path.join(HERE, "worker_%s.py" % name)]
    return [
        Renderer("brume", [os.path.join(build, "test", "bench", "worker")], None,
                 ["uniform", "adaptive"], ["uniform", "adaptive"],
                 "as `render-cli --spp N`, with and without `--adaptive on`"),
        Renderer("mitsuba", worker("mitsuba"), "mitsuba",
                 ["llvm_ad_rgb,independent", "llvm_ad_rgb,multijitter", "scalar_rgb,independent"],
                 ["llvm_ad_rgb,independent", "llvm_ad_rgb,multijitter", "scalar_rgb,independent"],
                 "variants llvm_ad_rgb and scalar_rgb, samplers independent and multijitter, 64 or 256 samples a pass"),
        Renderer("cycles", worker("cycles"), "bpy", ["equiangular", "mis", "distance"], ["path"],
                 "volume sampling equiangular, distance and multiple importance; light tree on, clamping, adaptive "
                 "sampling and denoising off, data persistent, box filter"),
        Renderer("luxcore", worker("luxcore"), "pyluxcore", ["log_power"], ["log_power"],
                 "PATHCPU, Sobol' points, light strategy LOG_POWER, no clamping, box filter"),
    ]


class Worker:
    """One renderer at work. Its own output goes to `log`."""

    def __init__(self, renderer, log):
        self.process = subprocess.Popen(renderer.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
                                        universal_newlines=True, bufsize=1)
        self.selector = selectors.DefaultSelector()
        self.selector.register(self.process.stdout, selectors.EVENT_READ)

    def ask(self, *words, limit=900):
        try:
            self.process.stdin.write(" ".join(words) + "\n")
            self.process.stdin.flush()
            end = time.monotonic() + limit
            if not self.selector.select(max(0, end - time.monotonic())):
                raise Failure("no reply within %g s" % limit)
            reply = self.process.stdout.readline().split(None, 1)
        except OSError as error:
            raise Failure("its process has ended") from error
        if not reply:
            raise Failure("its process has ended, status %s" % self.process.wait())
        if reply[0] != "ok":
            raise Failure(reply[1].strip() if len(reply) > 1 else "failed")
        return reply[1].split()

    def close(self):
        try:
            self.process.stdin.close()
            self.process.wait(20)
        except (OSError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()
