#!/usr/bin/env python3
"""Computes every figure of a study anew, with numpy, from the pictures in its folder, and compares with study.csv and
study.json, all but the error that the renderer estimates. Shares nothing with the program but the definitions, which
the page spells out.

    check_figures.py FOLDER [--require-flip]

Exit status 0: all agree; 1: some don't; 77: numpy isn't there. NVIDIA's flip_evaluator judges FLIP as well if it is."""

import csv
import json
import os
import sys

try:
    import numpy as np
except ImportError:
    print("check_figures: skipped, python3 has no numpy")
    sys.exit(77)
try:
    import flip_evaluator
except ImportError:
    flip_evaluator = None

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def read_pfm(path):
    with open(path, "rb") as file:
        assert file.readline() == b"PF\n"
        width, height = map(int, file.readline().split())
        assert float(file.readline()) < 0
        data = np.frombuffer(file.read(), "<f4").astype(np.float64)
    return data.reshape(height, width, 3)[::-1]


def windows(plane, radius, mode, **keywords):
    """All shifts of a plane by up to `radius`, along two new axes in front."""
    padded = np.pad(plane, radius, mode=mode, **keywords)
    size = 2 * radius + 1
    return np.array([[padded[v:v + plane.shape[0], u:u + plane.shape[1]] for u in range(size)] for v in range(size)])


# ---- errors ----------------------------------------------------------------------------------------------------------


def weights(reference):
    return 1 / (reference ** 2 + 0.01 * reference.mean() ** 2)


def relmse_map(picture, reference):
    return ((picture - reference) ** 2 * weights(reference)).mean(-1)


def trimmed(errors):
    errors = np.sort(errors.ravel())
    return errors[:errors.size - int(0.001 * errors.size)].mean()


def fireflies(picture, reference):
    y = reference @ LUMINANCE
    about = np.nanmax(windows(y, 1, "constant", constant_values=np.nan), axis=(0, 1))
    return int((picture @ LUMINANCE > 4 * (about + 0.1 * y.mean())).sum())


# ---- FLIP, with kernels in two dimensions ----------------------------------------------------------------------------

PPD = 0.7 * 3840 / 0.7 * np.pi / 180
TO_XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                   [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                   [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
WHITE = TO_XYZ.sum(1)


def convolve(plane, kernel):
    radius = kernel.shape[0] // 2
    padded = np.pad(plane, radius, mode="edge")
    out = np.zeros_like(plane)
    for v in range(kernel.shape[0]):
        for u in range(kernel.shape[1]):
            out += kernel[v, u] * padded[v:v + plane.shape[0], u:u + plane.shape[1]]
    return out


def grid(radius):
    return np.meshgrid(np.arange(-radius, radius + 1), np.arange(-radius, radius + 1))


def ycxcz(rgb):
    x, y, z = np.moveaxis(rgb @ TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def from_ycxcz(colour):
    y = (colour[..., 0] + 16) / 116
    xyz = np.stack([y + colour[..., 1] / 500, y, y - colour[..., 2] / 200], -1) * WHITE
    return xyz @ np.linalg.inv(TO_XYZ).T


def hunt(rgb):
    t = rgb @ TO_XYZ.T / WHITE
    limit = 6 / 29
    f = np.where(t > limit ** 3, np.cbrt(t), t / (3 * limit ** 2) + 4 / 29)
    lightness = 116 * f[..., 1] - 16
    return np.stack([lightness, 0.01 * lightness * 500 * (f[..., 0] - f[..., 1]),
                     0.01 * lightness * 200 * (f[..., 1] - f[..., 2])], -1)


def hyab(a, b):
    d = a - b
    return np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2])


def seen(colour):
    radius = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi ** 2)) * PPD))
    x, y = grid(radius)
    square = (x ** 2 + y ** 2) / PPD ** 2
    planes = []
    for c, terms in enumerate([[(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]]):
        kernel = sum(a * np.sqrt(np.pi / b) * np.exp(-np.pi ** 2 * square / b) for a, b in terms)
        planes.append(convolve(colour[..., c], kernel / kernel.sum()))
    return np.stack(planes, -1)


def features(plane, order):
    deviation = 0.5 * 0.082 * PPD
    x, y = grid(int(np.ceil(3 * deviation)))
    bell = np.exp(-(x ** 2 + y ** 2) / (2 * deviation ** 2))
    kernel = -x * bell if order == 1 else (x ** 2 / deviation ** 2 - 1) * bell
    kernel = np.where(kernel > 0, kernel / kernel[kernel > 0].sum(), kernel / -kernel[kernel < 0].sum())
    return np.hypot(convolve(plane, kernel), convolve(plane, kernel.T))


def flip(reference, picture, exposure):
    sides = []
    for side in (reference, picture):
        colour = ycxcz(np.clip(side * exposure, 0, 1))
        plane = (colour[..., 0] + 16) / 116
        sides.append((hunt(np.clip(from_ycxcz(seen(colour)), 0, 1)), features(plane, 1), features(plane, 2)))
    most = hyab(hunt(np.array([0.0, 1, 0])), hunt(np.array([0.0, 0, 1]))) ** 0.7
    colour = hyab(sides[0][0], sides[1][0]) ** 0.7
    knee = 0.4 * most
    colour = np.where(colour < knee, colour * 0.95 / knee, 0.95 + 0.05 * (colour - knee) / (most - knee))
    edge, point = np.abs(sides[0][1] - sides[1][1]), np.abs(sides[0][2] - sides[1][2])
    return (colour ** (1 - np.sqrt(np.maximum(edge, point) / np.sqrt(2)))).mean()


def nvidia_flip(reference, picture, exposure):
    def shown(side):
        linear = np.clip(side * exposure, 0, 1)
        return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055).astype(np.float32)
    return flip_evaluator.evaluate(shown(reference), shown(picture), "LDR", inputsRGB=True, applyMagma=False,
                                   computeMeanError=True, parameters={"ppd": float(PPD)})[1]


# ---- the study -------------------------------------------------------------------------------------------------------


class Check:
    def __init__(self):
        self.compared = self.wrong = 0

    def near(self, name, theirs, ours, tolerance=1e-6, floor=0.0):
        self.compared += 1
        theirs = float("nan") if theirs in ("", None) else float(theirs)
        if np.isnan(theirs) and np.isnan(ours):
            return
        if not abs(theirs - ours) <= tolerance * abs(ours) + floor:
            self.wrong += 1
            print("%s: the study says %.9g, numpy %.9g" % (name, theirs, ours))


def front(points):
    return [i for i, (t, e) in enumerate(points)
            if not any(u <= t and f <= e and (u < t or f < e) for u, f in points)]


def main():
    folder = sys.argv[1]
    check = Check()
    with open(os.path.join(folder, "study.json"), encoding="utf-8") as file:
        study = json.load(file)
    with open(os.path.join(folder, "study.csv"), encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))

    def picture(name, letter, samples):
        return read_pfm(os.path.join(folder, "pictures", "%s-%s-%s.pfm" % (name.replace(":", "-"), letter, samples)))

    halves = [picture("reference", letter, study["reference"]["samples"] // 2) for letter in "ab"]
    reference = ((halves[0] + halves[1]) / 2).astype(np.float32).astype(np.float64)
    own = 0.25 * ((halves[0] - halves[1]) ** 2 * weights(reference)).mean()
    check.near("reference relmse", study["reference"]["relmse"], own)
    check.near("reference mean", study["reference"]["mean"], reference.mean())
    bright = np.sort(reference.max(-1).ravel())
    check.near("exposure", study["reference"]["exposure"], 1 / bright[int(0.98 * (bright.size - 1) + 0.5)])
    exposure = study["reference"]["exposure"]

    first_seed = study["seed"]
    on_front = front([(p["seconds"], p["relmse"]) for s in study["settings"] for p in s["points"]])
    flips = 0
    for row in rows:
        name, samples, letter = row["setting"], int(row["samples"]), "ab"[int(row["seed"]) - first_seed]
        label = "%s %s %d " % (name, letter, samples)
        image = picture(name, letter, samples)
        errors = relmse_map(image, reference)
        e = 0.1 * reference.mean()
        difference = np.abs(image - reference)
        check.near(label + "relmse", row["relmse"], errors.mean())
        check.near(label + "trimmed", row["relmse_trimmed"], trimmed(errors))
        check.near(label + "mape", row["mape"], (difference / (np.abs(reference) + e)).mean())
        check.near(label + "smape", row["smape"], (difference / (np.abs(image) + np.abs(reference) + e)).mean())
        check.near(label + "fireflies", row["fireflies"], fireflies(image, reference))
        check.near(label + "mean ratio", row["mean_ratio"], image.mean() / reference.mean())
        sums = (image - reference).sum(-1)
        check.near(label + "deviates", row["deviates"], sums.sum() / np.sqrt((sums ** 2).sum()), 1e-5, 1e-6)
        a, b = picture(name, "a", samples), picture(name, "b", samples)
        w = weights(reference)
        check.near(label + "noise", row["pair_noise"], 0.5 * ((a - b) ** 2 * w).mean())
        common = ((a - reference) * (b - reference) * w).mean(-1)
        sigma = common.std() / np.sqrt(common.size)
        check.near(label + "bias", row["pair_bias"], common.mean() - own, 1e-6, 1e-9 * common.std())
        check.near(label + "bias sigma", row["pair_bias_sigma"], sigma)
        check.near(label + "flip", row["flip"], flip(reference, image, exposure), 1e-5)
        if flip_evaluator:
            flips += 1
            check.near(label + "flip, NVIDIA's", row["flip"], nvidia_flip(reference, image, exposure), 1e-3)

    index = 0
    for setting in study["settings"]:
        points = setting["points"]
        for point in points:
            pair = [row for row in rows
                    if row["setting"] == setting["name"] and int(row["samples"]) == point["samples"]]
            assert len(pair) == 2
            for key in ("render_seconds", "cpu_seconds", "relmse", "relmse_trimmed", "mape", "smape", "flip",
                        "fireflies", "estimated_relmse"):
                mean = np.mean([float(row[key] or "nan") for row in pair])
                check.near(setting["name"] + " " + key, point[key], mean, 1e-8)
            if study["clock"] == "cpu":
                seconds = point["cpu_seconds"] / study["compute_units"]
            else:
                seconds = point["render_seconds"]
            check.near(setting["name"] + " clock", point["seconds"], seconds, 1e-8)
            sums = sum(picture(setting["name"], letter, point["samples"]) for letter in "ab") / 2 - reference
            sums = sums.astype(np.float32).astype(np.float64).sum(-1)
            check.near(setting["name"] + " deviates", point["pair_deviates"], sums.sum() / np.sqrt((sums ** 2).sum()),
                       1e-4, 1e-4)
            check.near(setting["name"] + " front", point["on_front"], index in on_front)
            check.near(setting["name"] + " floor", point["near_floor"], point["relmse"] < 4 * own)
            index += 1
        clear = [p for p in points if not p["near_floor"]]
        times = [p["seconds"] for p in points]

        def slope(some, key):
            if len(some) < 3:
                return float("nan")
            return np.polyfit(np.log([p["seconds"] for p in some]), np.log([p[key] for p in some]), 1)[0]

        check.near(setting["name"] + " slope", setting.get("slope"), slope(clear, "relmse"), 1e-5, 1e-9)
        falls = slope(points, "noise")
        check.near(setting["name"] + " noise slope", setting.get("noise_slope"), falls, 1e-5, 1e-9)
        if not points:
            continue
        last = points[-1]
        bias = last["bias"] if last["bias"] > 3 * last["bias_sigma"] else 0
        check.near(setting["name"] + " bias", setting["bias"], bias)
        wanted = (bias + last["noise"]) / 2 - bias
        ours = (wanted / last["noise"]) ** (1 / falls) if wanted > 0 and falls < 0 else float("nan")
        check.near(setting["name"] + " halving", setting["time_factor_to_halve"], ours, 1e-5)
        if times[0] <= study["time_target"] <= times[-1]:
            ours = np.exp(np.interp(np.log(study["time_target"]), np.log(times), np.log([p["relmse"] for p in points])))
            check.near(setting["name"] + " at the time", setting["relmse_at_time_target"], ours, 1e-6)
        below = [i for i, p in enumerate(points) if p["relmse"] <= study["target"]]
        if below and below[0] > 0:
            i = below[0]
            errors = -np.log([points[i - 1]["relmse"], points[i]["relmse"]])
            ours = np.exp(np.interp(-np.log(study["target"]), errors, np.log([times[i - 1], times[i]])))
            check.near(setting["name"] + " time to target", setting["time_to_target"], ours, 1e-6)
            check.near(setting["name"] + " kind", setting["time_to_target_is"] == "between", 1)

    for r in study["rounding"]:
        a, b = picture(r["single"], "a", r["samples"]), picture(r["double"], "a", r["samples"])
        d = (np.abs(a - b) / (np.abs(b) + 0.1 * reference.mean())).max(-1).ravel()
        check.near("rounding median", r["median"], np.sort(d)[int(0.5 * (d.size - 1) + 0.5)])
        check.near("rounding most", r["most"], d.max())
        check.near("rounding root mean square", r["root_mean_square"], np.sqrt((d ** 2).mean()))
        check.near("rounding share", r["share_above_0.001"], (d > 1e-3).mean())

    print("%d figures of %d pictures compared, %d wrong%s" % (
        check.compared, len(rows), check.wrong, ", FLIP of %d by NVIDIA's program too" % flips if flips else ""))
    if not rows or (len(sys.argv) > 2 and sys.argv[2] == "--require-flip" and not flips):
        return 1
    return 1 if check.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
