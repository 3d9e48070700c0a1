/* parallel.h -- the same work on many pieces, in several threads. */
#ifndef BRUME_PARALLEL_H
#define BRUME_PARALLEL_H

#include <stdint.h>

enum { BRUME_PARALLEL_MOST = 128 };

/* Calls work(user, i) once for each i below count, in this thread and up to threads - 1 others, at most
 * BRUME_PARALLEL_MOST in all, which have ended on return; in what order, is left to chance. Threads that can't be
 * started are fewer threads, no failure. With one thread or one piece it is a loop, in order. */
void brume_parallel(uint32_t threads, uint32_t count, void (*work)(void *user, uint32_t i), void *user);

#endif
