"""What the workers of `make bench` share: a renderer in a process of its own, told what to do on standard input.

    load SCENE MODE NAME=VALUE...   replies "ok SECONDS VERSION"
    render SPP SEED FILE            replies "ok WALL CPU SPP": seconds of the clock and of all processors; FILE gets
                                    height x width x 3 floats, rows from the top
    Anything that fails replies "error TEXT".

What renderers print goes to standard error.
"""

import os
import resource
import shlex
import sys
import time

import numpy


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def serve(load, render):
    """load(path, mode, parameters) -> version; render(spp, seed) -> (picture, samples per pixel that it has)."""
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        words = shlex.split(line)
        try:
            start, cpu = time.monotonic(), cpu_seconds()
            if words[0] == "load":
                version = load(words[1], words[2], dict(word.split("=", 1) for word in words[3:]))
                reply = "ok %.6f %s" % (time.monotonic() - start, version)
            else:
                picture, spp = render(int(words[1]), int(words[2]))
                reply = "ok %.6f %.6f %d" % (time.monotonic() - start, cpu_seconds() - cpu, spp)
                numpy.ascontiguousarray(picture, dtype=numpy.float32).tofile(words[3])
        except Exception as error:
            reply = "error %s: %s" % (type(error).__name__, str(error).replace("\n", " "))
        replies.write(reply + "\n")
        replies.flush()
    replies.close()
    os._exit(0)  # some of them can't be taken down
