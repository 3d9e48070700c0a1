"""How far pictures are from the truth, and when a renderer gets how near: the arithmetic of `make bench`.

The truth is known by two independent pictures A and B of the same renderer. (I - A)(I - B) is on average (I - truth)^2,
without the noise of either, so that references need not be many times as accurate as what they judge. What that is
relative to, though, has to be free of noise: a reference that has missed the light of a dark pixel, or caught a firefly
there, would weigh it wrongly by orders of magnitude. `weights` are therefore the same for everybody.
"""

import math

import numpy

DROPPED = 0.001  # share of pixels, the worst ones, that the error leaves out: fireflies


def weights(a, b):
    """1 / (R^2 + 0.01 mean(R)^2) of the picture R = (A + B) / 2."""
    r = (a.astype(float) + b) / 2
    return 1 / (r ** 2 + 0.01 * r.mean() ** 2)


def relmse(picture, a, b, weight, dropped=DROPPED):
    """Mean of (I - R)^2 / (R^2 + 0.01 mean(R)^2) over channels and all but the worst pixels."""
    i = picture.astype(float)
    return _mean_of_most(((i - a) * (i - b) * weight).mean(2), dropped)


def relmse_of_mean(a, b, weight, dropped=DROPPED):
    """What (A + B) / 2 is off by; half of what each is."""
    return _mean_of_most(((a.astype(float) - b) ** 2 / 4 * weight).mean(2), dropped)


def _mean_of_most(errors, dropped):
    count = errors.size - int(dropped * errors.size)
    return float(numpy.sort(errors, axis=None)[:count].mean())


def mean_and_sigma(a, b):
    """Of the picture (A + B) / 2: its mean, and that mean's standard error, from how A - B spreads over the pixels."""
    difference = (a.astype(float) - b).mean(2).ravel()
    return float((a.mean(dtype=float) + b.mean(dtype=float)) / 2), float(
        numpy.sqrt((difference ** 2).sum()) / 2 / difference.size)


def agree(mean, other, tolerance=0.02):
    """Whether two means differ by at most `tolerance`. That they are too noisy to be told apart is no excuse: a longer
    reference tells them apart."""
    return abs(mean - other) <= tolerance * other


def time_to(points, target):
    """Seconds until the error is `target`, and whether that lies beyond what was measured. points: (seconds, error),
    ascending. Between two of them a power law; beyond them that of the last three, but no steeper than -1, which noise
    comes to in the end, and no flatter than -1/2. None without points."""
    points = [(t, e) for t, e in points if t > 0 and e > 0]
    if not points:
        return None, False
    if len(points) == 1:
        (t, e), order = points[0], -1
        return t * (target / e) ** (1 / order), not 0.99 < target / e < 1.01
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e0 >= target >= e1 and e0 > e1:
            return t0 * (t1 / t0) ** (math.log(target / e0) / math.log(e1 / e0)), False
    if points[0][1] < target:
        return points[0][0], False  # it was there before the first point; to be read as "at most"
    order = slope(points[-3:])
    return points[-1][0] * (target / points[-1][1]) ** (1 / min(-0.5, max(-1.0, order))), True


def error_at(points, seconds):
    """The error after so many seconds, and whether that is beyond what was measured; there the order is from -2, which
    stratified points can keep up for long, to -1/2."""
    points = [(t, e) for t, e in points if t > 0 and e > 0]
    if not points:
        return None, False
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if t0 <= seconds <= t1:
            return e0 * (e1 / e0) ** (math.log(seconds / t0) / math.log(t1 / t0)), False
    t, e = points[-1] if seconds > points[-1][0] else points[0]
    order = slope(points[-3:] if seconds > t else points[:3]) if len(points) > 1 else -1
    return e * (seconds / t) ** min(-0.5, max(-2.0, order)), not 0.8 < seconds / t < 1.25


def slope(points):
    """Exponent of the power law through (x, y), by least squares on logarithms."""
    x, y = (numpy.log([p[k] for p in points]) for k in (0, 1))
    return float(((x - x.mean()) * (y - y.mean())).sum() / max(((x - x.mean()) ** 2).sum(), 1e-12))
