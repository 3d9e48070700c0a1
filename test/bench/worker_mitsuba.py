"""Mitsuba 3. A mode is VARIANT,SAMPLER: llvm_ad_rgb or scalar_rgb, independent or
multijitter. The integrator is the scene's."""

import os
import sys

import numpy

import worker

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "crosscheck"))
import crosscheck

state = {}


def load(path, mode, parameters):
    variant, sampler = mode.split(",")
    llvm = os.environ.get("DRJIT_LIBLLVM_PATH") or crosscheck.find_llvm()
    if variant.startswith("llvm"):
        if not llvm:
            raise RuntimeError("no libLLVM that suits it (Debian: libllvm19)")
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    import mitsuba
    mitsuba.set_variant(variant)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    import drjit
    drjit.set_thread_count(len(os.sched_getaffinity(0)))
    state.update(mitsuba=mitsuba, sampler=sampler, scene=mitsuba.load_file(path, sampler=sampler, **parameters))
    return mitsuba.__version__


def render(spp, seed):
    """Passes of up to 64 samples, which suits its wavefronts' memory; stratified ones of 256, for the strata."""
    most = 64 if state["sampler"] == "independent" else 256
    total, done = 0, 0
    while done < spp:
        now = min(most, spp - done)
        picture = state["mitsuba"].render(state["scene"], spp=now, seed=1000 * seed + done // most)
        total = total + now * numpy.array(picture)
        done += now
    return total[:, :, :3] / done, done


worker.serve(load, render)
