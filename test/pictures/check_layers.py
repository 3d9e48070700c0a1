"""check_layers.py FILE -- the layers of an EXR with all of them: their names and types; the parts of the light add up to
the picture within the rounding of halves; an error planted in one of them is found."""
import sys

import numpy
import OpenEXR

NAMES = {"R", "G", "B", "Z", "N.X", "N.Y", "N.Z", "sampleCount", "segments", "badSamples"} | {
    "%s.%s" % (layer, c) for layer in ("albedo", "variance", "direct", "indirect", "surface", "volume") for c in "RGB"}


def wrong(channels, layer):
    picture, a, b = (numpy.stack([channels[prefix + c] for c in "RGB"], -1) for prefix in ("", *layer))
    # Three halves, each rounded by 2^-11 of itself, or by half of 2^-24 where it is tiny.
    bound = 2.0 ** -11 * (abs(picture) + abs(a) + abs(b)) + 2.0 ** -23
    return int((abs(a + b - picture) > bound).sum())


with OpenEXR.File(sys.argv[1], separate_channels=True) as file:
    found = {name: numpy.array(c.pixels) for name, c in file.channels().items()}
channels = {name: pixels.astype(numpy.float64) for name, pixels in found.items()}
problems = ["channels: %s" % sorted(NAMES ^ set(channels))] if NAMES != set(channels) else []
problems += ["%s is %s" % (name, found[name].dtype) for name in ("Z", "N.X", "sampleCount", "variance.R", "segments")
             if found[name].dtype != numpy.float32]
pairs = ("direct.", "indirect."), ("surface.", "volume.")
problems += ["%s%s don't add up in %d values" % (*pair, wrong(channels, pair)) for pair in pairs if wrong(channels, pair)]
planted = dict(channels, **{"volume.G": channels["volume.G"] * 1.02})
if not wrong(planted, pairs[1]):
    problems.append("2 % more volume light were not found")
if not (channels["segments"] >= 1).all() or (channels["sampleCount"] != 8).any() or channels["badSamples"].any():
    problems.append("segments, sampleCount or badSamples are not what they should be")
for problem in problems:
    print("FAILED: " + problem)
print("layers: %s" % ("as expected" if not problems else "%d FAILED" % len(problems)))
sys.exit(bool(problems))
