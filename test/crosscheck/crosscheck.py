#!/usr/bin/env python3
"""Renders the scenes beside this file with render-cli and with Mitsuba 3, and compares the pictures.

Both renderers run every case with several independent seeds, so the spread over the seeds gives the variance of a mean
without any assumption about samplers. A case passes if

 - no block of pixels differs, in any channel, by more than TOLERANCE of its value, at CONFIDENCE: Welch's two-sample
   t-test per block and channel with Sidak's correction for their number;
 - the mean of the picture differs by less than 0.5 % in every channel (or three standard errors, if that is more);
 - that mean is known well enough for the 0.5 % to say something: a standard error below 0.25 %.

    crosscheck.py BUILD [--quick] [--only TEXT] [--plant scale|shift] [--reference-only]

BUILD holds render-cli; the virtual environment, the reference pictures (which are kept: a changed scene has another name)
and, for failed cases, ours/reference/difference as PNG go to BUILD/crosscheck. --plant adds a bug to our pictures (2 % more
light, or everything one pixel to the right) and demands that each case fails: proof that the test can.

Mitsuba runs in its llvm variant if there is a libLLVM for it (Debian: libllvm19), else in the much slower scalar one.
"""

import argparse
import glob
import hashlib
import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
CONFIDENCE = 0.999
TOLERANCE = 2e-4
MEAN_LIMIT = 0.005
MEAN_SIGMA = 0.0025


class Case:
    """One scene file with parameters. Samples are per pixel and seed; `margin` pixels at the edge are left out: there
    Mitsuba normalises the filter by what lies inside the picture, and ours samples beyond it."""

    def __init__(self, scene, reference_spp, our_spp, quick=False, block=4, margin=0, **parameters):
        self.scene = os.path.join(HERE, scene + ".xml")
        self.reference_spp, self.our_spp = reference_spp, our_spp
        self.quick, self.block, self.margin = quick, block, margin
        self.parameters = {key: str(value) for key, value in parameters.items()}
        self.name = " ".join([scene] + ["%s=%s" % item for item in self.parameters.items() if item[0] not in CROP])

    def file_name(self):
        return self.name.replace(" ", ",")


CROP = dict(crop_x=9, crop_y=5, crop_width=40, crop_height=30)
CASES = [
    Case("room", 128, 128, quick=True),
    Case("room", 256, 128, depth=2),
    Case("room", 128, 128, depth=-1),
    Case("view", 64, 64, axis="x"),
    Case("view", 64, 64, axis="y"),
    Case("view", 64, 64, axis="smaller", width=36, height=60),
    Case("view", 64, 64, axis="larger", width=36, height=60, **dict(CROP, crop_width=20)),
    Case("view", 64, 64, axis="diagonal", quick=True, **CROP),
    Case("view", 64, 64, camera="focal"),
    Case("view", 128, 128, camera="lens"),
    Case("view", 256, 256, filter="tent", margin=1, **CROP),
    Case("view", 256, 256, filter="gaussian", margin=2, **CROP),
    Case("view", 512, 512, filter="mitchell", margin=2, quick=True, **CROP),
    Case("view", 512, 512, filter="catmullrom", margin=2),
    Case("view", 512, 512, filter="lanczos", margin=3, **CROP),
    Case("meshes", 144, 64, quick=True),
    Case("glass", 512, 256),
    Case("metals", 128, 128, quick=True),
    Case("sides", 289, 128, quick=True),
    Case("arealights", 256, 128),
    Case("arealights", 256, 128, hide="true", quick=True),
    Case("spots", 64, 32, quick=True, sampler="ldsampler"),
    Case("spots", 128, 64, depth=5),
    Case("sky", 256, 128, quick=True),
    Case("sky", 256, 128, hide="true"),
    Case("sky", 256, 128, integrator="direct"),
    Case("fogspot", 1024, 64, depth=2, g=0, quick=True),
    Case("fogspot", 1024, 64, depth=2, g=0.9),
    Case("fogspot", 1024, 128, depth=3, g=-0.7),
    Case("fogspot", 1024, 256, depth=3, g=0, integrator="volpathmis"),
    Case("fogspot", 384, 256, depth=8, g=0.6, around="bubbles"),
    Case("fogspot", 384, 256, depth=-1, medium="isotropic", around="bubbles"),
    Case("cloud", 256, 256, quick=True),
    Case("cloud", 256, 256, integrator="volpath", depth=2),
    Case("inside", 512, 256),
    Case("inside", 512, 256, integrator="volpathmis", depth=3),
    Case("glassfog", 512, 256, quick=True),
    Case("nested", 384, 512),
    Case("nested", 512, 512, integrator="volpathmis", depth=3),
    Case("cloudsky", 256, 256),
    Case("cloudsky", 256, 256, hide="true"),
    Case("fogarea", 256, 256),
    Case("fogarea", 512, 256, integrator="volpath", depth=3),
]


# ---- the virtual environment ------------------------------------------------------------------------------------------


def enter_environment(folder):
    """Continues in a virtual environment with the packages of requirements.txt, made the first time."""
    venv = os.path.join(folder, "venv")
    python = os.path.join(venv, "bin", "python")
    with open(os.path.join(HERE, "requirements.txt"), encoding="ascii") as file:
        wanted = file.read()
    stamp = os.path.join(venv, "requirements.txt")
    if not os.path.exists(stamp) or open(stamp, encoding="ascii").read() != wanted:
        print("installing Mitsuba into", venv, flush=True)
        try:
            subprocess.run([sys.executable, "-m", "venv", venv], check=True)
            subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", "-r",
                            os.path.join(HERE, "requirements.txt")], check=True)
        except subprocess.CalledProcessError:
            print("crosscheck: no virtual environment (Debian: python3-venv), or no packages from PyPI", file=sys.stderr)
            sys.exit(77)  # nothing was compared: neither passed nor failed
        with open(stamp, "w", encoding="ascii") as file:
            file.write(wanted)
    if os.path.realpath(sys.prefix) != os.path.realpath(venv):
        os.execv(python, [python, os.path.abspath(__file__)] + sys.argv[1:])


def find_llvm():
    """The newest libLLVM from 16 on; older ones make Mitsuba's llvm variants abort."""
    found = []
    for path in glob.glob("/usr/lib/*/libLLVM*.so*") + glob.glob("/usr/lib/llvm-*/lib/libLLVM*.so*"):
        digits = os.path.basename(path).replace("libLLVM", "").lstrip("-.").replace("so.", "").split(".")[0]
        if digits.isdigit() and int(digits) >= 16:
            found.append((int(digits), path))
    return max(found)[1] if found else None


# ---- the two renderers ------------------------------------------------------------------------------------------------


def reference_images(mitsuba, numpy, case, seeds, folder):
    """seeds x height x width x 3. Kept on disk under a name made from everything that matters."""
    key = hashlib.sha256()
    for path in sorted(glob.glob(os.path.join(HERE, "part_*.xml")) + glob.glob(os.path.join(HERE, "assets", "*"))):
        key.update(open(path, "rb").read())
    key.update(open(case.scene, "rb").read())
    key.update(repr((mitsuba.__version__, mitsuba.variant(), sorted(case.parameters.items()), case.reference_spp,
                     seeds)).encode())
    path = os.path.join(folder, "reference", key.hexdigest()[:24] + ".npy")
    if os.path.exists(path):
        return numpy.load(path)
    scene = mitsuba.load_file(case.scene, **case.parameters)
    images = [numpy.array(mitsuba.render(scene, spp=case.reference_spp, seed=seed), dtype=numpy.float32)[:, :, :3]
              for seed in range(seeds)]
    os.makedirs(os.path.dirname(path), exist_ok=True)
    numpy.save(path + ".tmp.npy", numpy.array(images))
    os.rename(path + ".tmp.npy", path)
    return numpy.array(images)


def our_images(mitsuba, numpy, case, seeds, folder, renderer):
    images = []
    path = os.path.join(folder, "ours-%d.exr" % os.getpid())
    for seed in range(seeds):
        command = [renderer, case.scene, "-o", path, "-q", "--spp", str(case.our_spp), "--seed", str(1000 + seed)]
        for item in case.parameters.items():
            command += ["-D", "%s=%s" % item]
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        if run.returncode:
            raise RuntimeError("render-cli exits %d: %s" % (run.returncode, run.stdout.decode(errors="replace").strip()))
        bitmap = mitsuba.Bitmap(path)
        names = [field.name for field in bitmap.struct_()]
        images.append(numpy.array(bitmap, dtype=numpy.float32)[:, :, [names.index(name) for name in "RGB"]])
        os.remove(path)
    return numpy.array(images)


# ---- statistics -------------------------------------------------------------------------------------------------------


def incomplete_beta(numpy, a, b, x):
    """Regularised, by the continued fraction (Numerical Recipes 6.4, modified Lentz); arrays of one shape."""
    from math import lgamma
    lgamma = numpy.vectorize(lgamma)
    turn = x > (a + 1) / (a + b + 2)
    a, b, x = numpy.where(turn, b, a), numpy.where(turn, a, b), numpy.where(turn, 1 - x, x)
    x = numpy.clip(x, 1e-300, 1)
    front = numpy.exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * numpy.log(x) + b * numpy.log1p(-x)) / a
    c = numpy.ones_like(x)
    d = 1 / (1 - (a + b) * x / (a + 1))
    total = d.copy()
    for m in range(1, 300):
        for factor in (m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
                       -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))):
            d = 1 / (1 + factor * d)
            c = 1 + factor / c
            total *= c * d
    return numpy.where(turn, 1 - front * total, front * total)


def welch(numpy, ours, reference):
    """Two-sided p of Welch's t-test for |mean difference| <= TOLERANCE of the value, along the first axis."""
    n, m = len(ours), len(reference)
    a, b = ours.mean(0), reference.mean(0)
    variance_a, variance_b = ours.var(0, ddof=1) / n, reference.var(0, ddof=1) / m
    variance = variance_a + variance_b
    excess = numpy.maximum(abs(a - b) - TOLERANCE * numpy.maximum(abs(a), abs(b)) - 1e-6, 0)
    freedom = variance ** 2 / numpy.maximum(variance_a ** 2 / (n - 1) + variance_b ** 2 / (m - 1), 1e-60)
    freedom = numpy.clip(freedom, min(n, m) - 1, n + m - 2)
    t2 = excess ** 2 / numpy.maximum(variance, 1e-30)
    return incomplete_beta(numpy, freedom / 2, numpy.full_like(freedom, 0.5), freedom / (freedom + t2))


def blocks(numpy, images, size, margin):
    """Means over size x size pixels: nearer to normal than pixels are."""
    if margin:
        images = images[:, margin:-margin, margin:-margin]
    count, height, width, channels = images.shape
    height, width = height // size * size, width // size * size
    images = images[:, :height, :width].astype(numpy.float64)
    return images.reshape(count, height // size, size, width // size, size, channels).mean((2, 4))


def compare(numpy, case, ours, reference):
    """What the table shows, and whether the case passes."""
    if ours.shape[1:] != reference.shape[1:]:
        return {"verdict": "SIZE %s, not %s" % (ours.shape[1:3], reference.shape[1:3]), "passed": False}
    p = welch(numpy, blocks(numpy, ours, case.block, case.margin), blocks(numpy, reference, case.block, case.margin))
    worst = numpy.unravel_index(numpy.argmin(p), p.shape)
    a, b = (blocks(numpy, images, 1, case.margin).mean((1, 2)) for images in (ours, reference))
    scale = numpy.maximum(abs(b.mean(0)), 1e-12)
    difference = (a.mean(0) - b.mean(0)) / scale
    sigma = numpy.sqrt(a.var(0, ddof=1) / len(a) + b.var(0, ddof=1) / len(b)) / scale
    channel = numpy.argmax(abs(difference))
    result = {
        "ours": a.mean(), "reference": b.mean(), "difference": difference[channel], "sigma": sigma[channel],
        "p": 1 - (1 - p.min()) ** p.size if p.min() > 1e-12 else p.min() * p.size,
        "where": (worst[1] * case.block + case.margin, worst[0] * case.block + case.margin),
    }
    verdicts = []
    if not numpy.isfinite(ours).all():
        verdicts.append("NAN")
    if result["p"] < 1 - CONFIDENCE:
        verdicts.append("BLOCKS")
    if (abs(difference) > numpy.maximum(MEAN_LIMIT, 3 * sigma)).any():
        verdicts.append("MEAN")
    if (sigma > MEAN_SIGMA).any():
        verdicts.append("NOISY")
    result["passed"] = not verdicts
    result["verdict"] = " ".join(verdicts) or "ok"
    return result


def write_pictures(mitsuba, numpy, case, ours, reference, folder):
    os.makedirs(folder, exist_ok=True)
    a, b = ours.mean(0), reference.mean(0)
    exposure = 0.5 / max(float(b.mean()), 1e-9)
    pictures = {"reference": b * exposure, "ours": a * exposure}
    if a.shape == b.shape:
        pictures["difference"] = 0.5 + (a - b) / numpy.maximum(0.1 * abs(b), 0.01 * b.mean() + 1e-9) * 0.5
    for name, pixels in pictures.items():
        bitmap = mitsuba.Bitmap(numpy.ascontiguousarray(pixels, dtype=numpy.float32))
        bitmap.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt8, name != "difference").write(
            os.path.join(folder, "%s-%s.png" % (case.file_name(), name)))


# ---- the run ----------------------------------------------------------------------------------------------------------


def plant(numpy, images, bug):
    if bug == "scale":
        return images * 1.02
    if bug == "shift":
        return numpy.roll(images, 1, axis=2)
    return images


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--quick", action="store_true", help="the cases for CI only")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name contains TEXT")
    parser.add_argument("--plant", choices=["scale", "shift"], help="add a bug; every case must fail")
    parser.add_argument("--reference-only", action="store_true", help="render Mitsuba's pictures, and write them as PNG")
    parser.add_argument("--seeds", type=int, default=16, help="of each renderer (16)")
    options = parser.parse_args()
    folder = os.path.join(os.path.abspath(options.build), "crosscheck")
    os.makedirs(folder, exist_ok=True)
    enter_environment(folder)

    llvm = os.environ.get("DRJIT_LIBLLVM_PATH") or find_llvm()
    if llvm:
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    import numpy
    import mitsuba
    mitsuba.set_variant("llvm_ad_rgb" if llvm else "scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    if not llvm:
        print("no libLLVM for Mitsuba (Debian: libllvm19): its scalar variant takes many times longer")

    renderer = os.path.join(os.path.abspath(options.build), "render-cli")
    cases = [case for case in CASES if (case.quick or not options.quick) and options.only in case.name]
    passed = []
    print("%-58s %10s %10s %8s %7s %9s %9s  %5s %5s  %s" % (
        "case", "ours", "Mitsuba", "diff %", "sigma %", "worst p", "at pixel", "ours", "Mi s", "verdict"))
    for case in cases:
        start = time.monotonic()
        reference = reference_images(mitsuba, numpy, case, options.seeds, folder)
        middle = time.monotonic()
        if options.reference_only:
            write_pictures(mitsuba, numpy, case, reference, reference, os.path.join(folder, "pictures"))
            means = reference.mean((1, 2))
            sigma = (means.std(0, ddof=1) / len(means) ** 0.5 / means.mean(0)).max()
            print("%-58s %10s %10.5g %8s %7.3f %35.1f" % (
                case.name, "", means.mean(), "", 100 * sigma, middle - start), flush=True)
            continue
        try:
            ours = our_images(mitsuba, numpy, case, options.seeds, folder, renderer)
        except (RuntimeError, OSError, ValueError) as error:
            print("%-58s FAILED: %s" % (case.name, error), flush=True)
            passed.append(False)
            continue
        end = time.monotonic()
        ours = plant(numpy, ours, options.plant)
        result = compare(numpy, case, ours, reference)
        passed.append(result["passed"])
        if "p" in result:
            print("%-58s %10.5g %10.5g %8.3f %7.3f %9.2g %4d,%4d  %5.1f %5.1f  %s" % (
                case.name, result["ours"], result["reference"], 100 * result["difference"], 100 * result["sigma"],
                result["p"], *result["where"], end - middle, middle - start, result["verdict"]), flush=True)
        else:
            print("%-58s %s" % (case.name, result["verdict"]), flush=True)
        if not result["passed"] and not options.plant:
            write_pictures(mitsuba, numpy, case, ours, reference, os.path.join(folder, "failed"))
    if options.reference_only:
        return 0
    if options.plant:
        print("%d of %d cases noticed the planted bug" % (passed.count(False), len(passed)))
        return 1 if any(passed) or not passed else 0
    print("%d of %d cases agree" % (passed.count(True), len(passed)))
    return 0 if passed and all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
