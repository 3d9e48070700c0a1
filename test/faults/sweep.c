/* sweep.c -- see sweep.h. */
#include "sweep.h"

#include <stdio.h>

void sweep_one(session_kind kind, const cl_fault *fault, sweep *s) {
    char loss[256], name[256];
    s->tried++;
    switch (session_with(kind, fault, loss)) {
    case SESSION_UNTOUCHED: s->untouched++; break;
    case SESSION_WENT_ON: s->went_on++; break;
    case SESSION_REPORTED: s->reported++; break;
    case SESSION_LOST:
        s->lost++;
        session_describe(kind, fault, name, sizeof name);
        printf("# %s: %s\n", name, loss);
        fflush(stdout);
    }
}

/* In all manners that the function has. */
static void sweep_manners(session_kind kind, cl_fault fault, sweep *s) {
    fault.manner = CL_FAILS;
    sweep_one(kind, &fault, s);
    fault.manner = CL_FULL;
    sweep_one(kind, &fault, s);
    fault.manner = CL_LOST;
    sweep_one(kind, &fault, s);
    fault.manner = fault.function == CL_FINISH ? CL_DONE : CL_HALF;
    if (fault.function == CL_FINISH || fault.function == CL_ENQUEUE_ND_RANGE_KERNEL) sweep_one(kind, &fault, s);
}

void sweep_all(session_kind kind, sweep *s) {
    for (int f = 0; f < CL_FUNCTION_COUNT; f++)
        for (int thread = 0; thread < 2; thread++) {
            const cl_int *errors = cl_shim_errors((cl_function)f);
            unsigned calls = session_calls(kind, (cl_function)f, thread), before = s->tried;
            int codes = 0;
            while (errors[codes]) codes++;
            for (unsigned n = 1; n <= calls; n++)
                for (int e = 0; e < codes; e++) {
                    cl_fault fault = {(cl_function)f, thread, n, errors[e], CL_FAILS};
                    if (kind == SESSION_CACHED) {
                        sweep_manners(kind, fault, s);
                    } else if (e == (int)(n % (unsigned)codes)) {
                        fault.manner = n % 3 == 0 ? CL_LOST : n % 3 == 1 ? CL_FAILS : CL_FULL;
                        sweep_one(kind, &fault, s);
                    }
                }
            if (s->verbose && calls)
                printf("# %s %s%s: %u calls, %u faults\n", session_names[kind], cl_shim_name((cl_function)f),
                       thread ? " in the thread" : "", calls, s->tried - before);
            fflush(stdout);
        }
}

void sweep_some(session_kind kind, sweep *s) {
    for (int f = 0; f < CL_FUNCTION_COUNT; f++)
        for (int thread = 0; thread < 2; thread++) {
            unsigned calls = session_calls(kind, (cl_function)f, thread), last = 0;
            const unsigned picked[3] = {1, (calls + 1) / 2, calls};
            const cl_int *errors = cl_shim_errors((cl_function)f);
            for (int i = 0, e = 0; i < 3; i++) {
                if (picked[i] <= last || picked[i] > calls) continue;
                last = picked[i];
                cl_fault fault = {(cl_function)f, thread, picked[i], errors[e], CL_FAILS};
                sweep_one(kind, &fault, s);
                e = errors[e + 1] ? e + 1 : 0;
            }
        }
}
