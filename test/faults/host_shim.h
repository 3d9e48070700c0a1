/* host_shim.h -- memory that runs out when told to: malloc, calloc, realloc and their aligned kin, defined in the test
 * program itself, so that every library finds these first. Only what the test's own thread asks for counts, and nothing
 * that it asks for inside an OpenCL call (cl_shim.h), which is the driver's.
 *
 * Not in programs with AddressSanitizer, whose allocator is its own.
 */
#ifndef HOST_SHIM_H
#define HOST_SHIM_H

#include <stddef.h>

int host_shim_works(void);

/* Counts allocations from 1 on, until host_shim_end. The n-th fails, with `forever` all from then on; 0: none. */
void host_shim_begin(unsigned n, int forever);
/* From now on only what other threads than the test's ask for counts. */
void host_shim_of_others(int others);
/* Nothing fails any more; counts and books go on. */
void host_shim_relent(void);
void host_shim_end(void);

unsigned host_shim_count(void);
int host_shim_fired(void);

/* Allocations since host_shim_begin that have not been freed, and for one of them the library that asked for it. */
size_t host_shim_left(char who[256]);

#endif
