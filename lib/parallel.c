/* parallel.c -- see parallel.h. Threads are started for each call: some 20 us each, for pieces that take longer. */
#include "parallel.h"

#include "platform.h"

typedef struct job {
    void (*work)(void *user, uint32_t i);
    void *user;
    uint32_t count;
    uint32_t next; /* atomically */
} job;

static void take_pieces(void *argument) {
    job *j = argument;
    uint32_t i;
    while ((i = __atomic_fetch_add(&j->next, 1, __ATOMIC_RELAXED)) < j->count) j->work(j->user, i);
}

void brume_parallel(uint32_t threads, uint32_t count, void (*work)(void *user, uint32_t i), void *user) {
    brume_thread *others[BRUME_PARALLEL_MOST - 1];
    uint32_t started = 0;
    job j = {work, user, count, 0};
    threads = threads < count ? threads : count;
    threads = threads < BRUME_PARALLEL_MOST ? threads : BRUME_PARALLEL_MOST;
    while (started + 1 < threads && (others[started] = brume_thread_start(take_pieces, &j)) != NULL) started++;
    take_pieces(&j);
    while (started > 0) brume_thread_join(others[--started]);
}
