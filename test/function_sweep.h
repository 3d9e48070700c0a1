/* function_sweep.h -- the cases of function_cases.h on the device, compared on all of the host's cores. */
#ifndef FUNCTION_SWEEP_H
#define FUNCTION_SWEEP_H

#include "brume.h"
#include "function_cases.h"

typedef struct function_sweep function_sweep;

/* The largest error among those looked at, and the first place where it is. */
typedef struct function_worst {
    double error;
    uint32_t bits, parameters; /* the input, and which row of parameters */
    function_result at;
    uint64_t compared;
} function_worst;

/* Builds the kernels of the cases whose name holds `only` (NULL: all). On failure brume_context_message says why. */
brume_result function_sweep_create(brume_context *context, brume_device *device, const char *only,
                                   function_sweep **out);
void function_sweep_destroy(function_sweep *sweep);

/* Every input of the case; `progress` (may be NULL) is told now and then what share is done. */
brume_result function_sweep_all(function_sweep *sweep, const function_case *c, void (*progress)(double share),
                                function_worst *out);

/* A sample: evenly spread over the inputs, the neighbours of powers of two, of the formula's edges and of the worst
 * place known. About `count` inputs for each row of parameters; of pairs all. */
brume_result function_sweep_some(function_sweep *sweep, const function_case *c, uint32_t count, function_worst *out);

/* "x = 0x1.8p-3 (0x3e400000), parameters 0.5, 2" */
void function_worst_place(const function_case *c, const function_worst *worst, char *text, size_t size);

#endif
