/* measure_file_faults.c -- every call by which pictures, checkpoints and sums of parts are written fails: `make trust`.
 * Prints a line for each that is lost, and the count. */
#include <stdio.h>

#include "faults/files.h"

int main(void) {
    unsigned lost = 0;
    int begun = files_begin_works();
    if (begun <= 0) {
        if (begun == 0) fprintf(stderr, "no OpenCL device\n");
        files_end_works();
        return begun == 0 ? 77 : 1;
    }
    for (int work = 0; work < FILES_WORKS; work++) {
        files_sweep s = {0};
        files_sweep_all((files_work)work, &s);
        printf("%s: %u failures tried: %u reported, %u went on, %u lost\n", files_names[work], s.tried, s.reported,
               s.went_on, s.lost);
        printf("trust\tA disk that fails while %s is written\t%u\t%u\n", files_names[work], s.tried, s.lost);
        lost += s.lost;
    }
    files_end_works();
    return lost != 0;
}
