"""One scene, rendered by all who take part, in turns."""

import hashlib
import os
import sys
import tempfile

import numpy

import judge
import renderers

CLOSE = 1.5  # a second mode of a peer goes on if its pilot is not worse than the best by more
ENOUGH = 1e-4  # error below which nothing is asked for, but where the goal is an error
REPEAT_BELOW = 0.4  # seconds: what is shorter is rendered three times


class Contender:
    """A renderer in a mode, in a scene: what it has done so far. If it can't go on, `failure` says why."""

    def __init__(self, renderer, mode, worker, pilots):
        self.renderer, self.mode, self.worker, self.pilots = renderer, mode, worker, pilots
        self.points, self.failure, self.fixed = [], None, 0.0

    def seconds(self, clock):
        """(seconds without what every render costs, error) of each point."""
        return [(max(p[clock] - self.fixed, 1e-4), p["error"]) for p in self.points]


class Contest:
    """everyone: the first is who the others are compared with. options: clock "wall" or "cpu", seconds,
    reference_seconds, plant; folder keeps references."""

    def __init__(self, everyone, row, options, folder, say):
        self.everyone, self.row, self.options, self.folder, self.say = everyone, row, options, folder, say
        self.log = open(os.path.join(folder, "workers.log"), "a", encoding="utf-8")
        self.weights, self.contenders = None, []

    def run(self):
        for renderer in self.everyone:
            contenders = self.pilot(renderer)
            for contender in contenders:
                self.attempt(contender, self.reference)
                if self.weights is None:
                    raise renderers.Failure("%s: %s" % (renderer.name, contender.failure))
            self.contenders += contenders
        self.compare_means()
        level, again = 0, True
        while again:
            again = False
            for contender in self.contenders:
                spp = self.next_samples(contender, level)
                if spp:
                    again = True
                    self.attempt(contender, self.measure, spp, level)
            level += 1
        for contender in self.contenders:
            if contender.worker:
                contender.worker.close()
        self.log.close()
        return self.contenders

    def attempt(self, contender, what, *arguments):
        if contender.failure is None:
            try:
                what(contender, *arguments)
            except renderers.Failure as failure:
                contender.failure = str(failure)
                self.say("%s: %s" % (contender.renderer.name, failure))

    # ---- a render ----------------------------------------------------------------------------------------------------

    def load(self, renderer, mode):
        worker = renderers.Worker(renderer, self.log)
        try:
            reply = worker.ask("load", self.row.path, mode, *("%s=%s" % item for item in self.row.parameters.items()))
        except renderers.Failure:
            worker.close()
            raise
        renderer.version = reply[1]
        return worker

    def render(self, worker, spp, seed):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.raw")
            wall, cpu, done = worker.ask("render", str(spp), str(seed), path)
            picture = numpy.fromfile(path, dtype=numpy.float32).reshape(self.row.size, self.row.size, 3)
        return picture, {"wall": float(wall), "cpu": float(cpu) / self.options.cores, "spp": int(done)}

    # ---- which mode --------------------------------------------------------------------------------------------------

    def pilot(self, renderer):
        """Each mode for a moment; the one with the least error times time goes on, and the next if it is close."""
        workers, figures, failure = {}, {}, None
        modes = renderer.modes if self.row.fog else renderer.modes_without_fog
        for mode in modes:
            try:
                workers[mode] = self.load(renderer, mode)
                figures[mode] = self.try_mode(workers[mode]) if len(modes) > 1 else 0.0
            except renderers.Failure as error:
                failure = str(error)
                self.say("%s %s: %s" % (renderer.name, mode, error))
        if not figures:
            contender = Contender(renderer, None, None, figures)
            contender.failure = failure
            return [contender]
        kept = sorted(figures, key=figures.get)[:2]
        if renderer is not self.everyone[0] and len(kept) > 1 and figures[kept[1]] > CLOSE * figures[kept[0]]:
            kept = kept[:1]
        for mode, worker in workers.items():
            if mode not in kept:
                worker.close()
        return [Contender(renderer, mode, workers[mode], figures) for mode in kept]

    def try_mode(self, worker):
        """Error times time, from the first render that is long enough."""
        self.render(worker, 1, 1)
        spp = 4
        while True:
            a, first = self.render(worker, spp, 2)
            b, second = self.render(worker, spp, 3)
            seconds = (first[self.options.clock] + second[self.options.clock]) / 2
            if seconds > self.options.seconds / 20 or spp >= 4096:
                weights = self.weights if self.weights is not None else judge.weights(a, b)
                return 2 * judge.relmse_of_mean(a, b, weights) * seconds
            spp *= 4

    # ---- references --------------------------------------------------------------------------------------------------

    def reference(self, contender):
        """Two independent pictures, each of half the time, kept under a name made from all that matters."""
        key = hashlib.sha256()
        for path in self.row.files:
            with open(path, "rb") as file:
                key.update(file.read())
        key.update(repr((contender.renderer.name, contender.renderer.version, sorted(self.row.parameters.items()),
                         self.options.reference_seconds)).encode())
        path = os.path.join(self.folder, "references", "%s-%s-%s.npy" % (
            self.row.name, contender.renderer.name, key.hexdigest()[:16]))
        if not os.path.exists(path) or self.options.fresh:
            self.say("reference of %s: about %.0f s" % (contender.renderer.name, self.options.reference_seconds))
            spp, seconds = 4, 0.0
            while seconds < self.options.reference_seconds / 40 and spp < 2 ** 20:
                spp *= 4
                seconds = self.render(contender.worker, spp, 4)[1]["wall"]
            spp = 2 ** round(numpy.log2(max(spp * self.options.reference_seconds / 2 / seconds, 1)))
            pair = [self.render(contender.worker, spp, seed)[0] for seed in (7001, 7002)]
            os.makedirs(os.path.dirname(path), exist_ok=True)
            numpy.save(path + ".tmp.npy", numpy.array(pair))
            os.replace(path + ".tmp.npy", path)
        contender.a, contender.b = numpy.load(path)
        if self.options.plant == contender.renderer.name:
            contender.a, contender.b = 1.05 * contender.a, 1.05 * contender.b
        contender.mean, contender.sigma = judge.mean_and_sigma(contender.a, contender.b)
        if self.weights is None:
            self.weights = judge.weights(contender.a, contender.b)
        contender.reference_error = judge.relmse_of_mean(contender.a, contender.b, self.weights)

    def compare_means(self):
        """Who renders something else than the first is not timed."""
        ours = self.contenders[0]
        for other in self.contenders:
            if other.renderer is ours.renderer or other.failure is not None:
                continue
            if not judge.agree(other.mean, ours.mean):
                other.failure = "refused: its mean is %+.1f %% off, one standard error being %.1f %%" % (
                    100 * (other.mean / ours.mean - 1), 100 * other.sigma / ours.mean)
                self.say("%s: %s" % (other.renderer.name, other.failure))

    # ---- error against time ------------------------------------------------------------------------------------------

    def next_samples(self, contender, level):
        """1, 4, 16 ... while they take less than the time there is, at the end perhaps twice the last."""
        if contender.failure:
            return 0
        if level == 0 or not contender.points:
            return 1
        last = contender.points[-1]
        if last["error"] < ENOUGH and not (self.row.goal and self.row.goal[0] == "error"):
            return 0
        seconds = last[self.options.clock]
        if seconds >= 0.7 * self.options.seconds or (
                len(contender.points) > 1 and last["spp"] < 4 * contender.points[-2]["spp"]):
            return 0
        for factor in (4, 2):
            if factor * seconds < 1.4 * self.options.seconds and last["spp"] * factor <= 2 ** 20:
                return last["spp"] * factor
        return 0

    def measure(self, contender, spp, level):
        """A point: of short renders the medians of three. The first two tell what a render costs besides samples."""
        clock, runs = self.options.clock, []
        if level == 0:
            self.render(contender.worker, 1, 9)  # compiles
            self.render(contender.worker, 4, 9)
        while not runs or (len(runs) < 3 and runs[0][clock] < REPEAT_BELOW):
            picture, run = self.render(contender.worker, spp, 100 + 10 * level + len(runs))
            if self.options.plant == contender.renderer.name + "-noise":
                picture = picture * numpy.random.default_rng(level).choice([0.5, 1.5], picture.shape)
            run["error"] = judge.relmse(picture, contender.a, contender.b, self.weights)
            run["error_of_all"] = judge.relmse(picture, contender.a, contender.b, self.weights, 0)
            runs.append(run)
        point = {key: float(numpy.median([run[key] for run in runs])) for key in runs[0]}
        point["spp"] = int(point["spp"])
        contender.points.append(point)
        if len(contender.points) == 2 and contender.renderer is not self.everyone[0]:
            first, second = contender.points
            each = (second[clock] - first[clock]) / max(1, second["spp"] - first["spp"])
            contender.fixed = max(0.0, first[clock] - max(0.0, each) * first["spp"])


def complain(text):
    print("bench: " + text, file=sys.stderr, flush=True)
