/* measure_cl_faults.c -- every OpenCL call of a session with every error that it may return: `make trust`. Names of
 * sessions on the command line ("cached") choose some. Prints a line for each that is lost, and the count. */
#include <stdio.h>
#include <string.h>

#include "faults/sweep.h"

int main(int argc, char **argv) {
    static const char *const words[SESSION_KINDS] = {"with a cached program", "with adaptive sampling",
                                                     "saved and gone on with", "from source", "with a quick start"};
    unsigned lost = 0;
    int begun = sessions_begin();
    if (begun <= 0) {
        if (begun == 0) fprintf(stderr, "no OpenCL device\n");
        sessions_end();
        return begun == 0 ? 77 : 1;
    }
    for (int kind = 0; kind < SESSION_KINDS; kind++) {
        int wanted = argc < 2;
        for (int i = 1; i < argc; i++) wanted |= strcmp(argv[i], session_names[kind]) == 0;
        if (!wanted) continue;
        sweep s = {.verbose = 1};
        sweep_all((session_kind)kind, &s);
        printf("%s: %u faults tried: %u reported, %u went on, %u untouched, %u lost\n", session_names[kind], s.tried,
               s.reported, s.went_on, s.untouched, s.lost);
        printf("trust\tOpenCL calls that fail, a render %s\t%u\t%u\n", words[kind], s.tried, s.lost);
        fflush(stdout);
        lost += s.lost;
    }
    sessions_end();
    return lost != 0;
}
