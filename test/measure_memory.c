/* measure_memory.c -- every allocation of loading and of rendering fails once, and then it and all later ones: `make
 * trust`. Prints a line for each that is lost, and the count. */
#include <stdio.h>

#include "faults/memory.h"

int main(void) {
    unsigned lost = 0;
    int begun = memory_begin();
    if (begun <= 0) {
        if (begun == 0) fprintf(stderr, "memory can't be made to run out here\n");
        return begun == 0 ? 77 : 1;
    }
    for (int work = 0; work < MEMORY_WORKS; work++) {
        memory_sweep s = {0};
        for (unsigned n = 1; n <= memory_allocations((memory_work)work); n++) {
            memory_try((memory_work)work, n, 0, &s);
            memory_try((memory_work)work, n, 1, &s);
        }
        printf("%s: %u failures tried: %u reported, %u went on, %u lost\n", memory_names[work], s.tried, s.reported,
               s.went_on, s.lost);
        printf("trust\tMemory that runs out while %s\t%u\t%u\n", memory_names[work], s.tried, s.lost);
        fflush(stdout);
        lost += s.lost;
    }
    memory_end();
    return lost != 0;
}
