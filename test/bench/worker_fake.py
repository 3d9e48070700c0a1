"""A renderer with a known answer, for check_bench.py: each pixel is VALUE plus normal noise of variance 1 / samples,
of which one takes 20 microseconds. The mode is VALUE; "broken" fails."""

import time

import numpy

import worker

state = {}


def load(path, mode, parameters):
    if mode == "broken":
        raise ValueError("as asked")
    state.update(value=float(mode), size=int(parameters["width"]))
    return "1"


def render(spp, seed):
    time.sleep(2e-5 * spp)
    noise = numpy.random.default_rng((seed, spp)).normal(0, spp ** -0.5, (state["size"], state["size"], 3))
    return state["value"] + noise, spp


worker.serve(load, render)
