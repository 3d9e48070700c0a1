/* sweep.h -- OpenCL calls that fail, over all that there are of them in a session, or a few of each kind. */
#ifndef SWEEP_H
#define SWEEP_H

#include "session.h"

typedef struct sweep {
    unsigned tried, reported, went_on, untouched, lost;
    int verbose;   /* counts for each function, to standard output */
} sweep;

/* Every call with every error: once, and with all later ones, of the same function and of all. In other sessions than
 * the cached one, which makes the same calls, every call with one error and in one manner, taken in turns. */
void sweep_all(session_kind kind, sweep *s);
/* Of each function the first call, the last and one between, with an error each. */
void sweep_some(session_kind kind, sweep *s);
/* One fault. What is lost is printed, a line each. */
void sweep_one(session_kind kind, const cl_fault *fault, sweep *s);

#endif
