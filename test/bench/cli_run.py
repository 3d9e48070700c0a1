"""One run of render-cli, with what it says and what the system says of it."""

import json
import os
import subprocess


class Run:
    """stats: the JSON of --stats; cpu: seconds of all processors; peak: bytes of memory at the most."""

    def __init__(self, stats, cpu, peak):
        self.stats, self.cpu, self.peak = stats, cpu, peak


def render(renderer, scene, arguments=(), parameters=None, environment=None):
    """Raises RuntimeError with what render-cli said. The picture goes nowhere."""
    command = [renderer, scene, "-q", "--stats", "json", "-o", "/dev/shm/bench-%d.exr" % os.getpid(), *arguments]
    for item in (parameters or {}).items():
        command += ["-D", "%s=%s" % item]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env=dict(os.environ, **(environment or {})), universal_newlines=True)
    out, err = process.stdout.read(), process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    process.stdout.close()
    process.stderr.close()
    try:
        os.remove(command[command.index("-o") + 1])
    except OSError:
        pass
    if status:
        raise RuntimeError("%s: %s" % (" ".join(command), err.strip() or "status %d" % status))
    return Run(json.loads(out), usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024)
