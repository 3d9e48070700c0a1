/* stability.c -- see stability.h. */
#include "stability.h"

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

void stability_row(const char *subject, const char *name, const char *reference, const char *unit, double tolerance,
                   double worst, const char *where, ...)
{
    char place[256];
    va_list arguments;
    va_start(arguments, where);
    vsnprintf(place, sizeof place, where, arguments);
    va_end(arguments);

    const char *path = getenv("BRUME_STABILITY");
    if (path && *path) {
        FILE *file = fopen(path, "a");
        if (!file)
            fail_msg("%s: can't be appended to", path);
        fprintf(file, "%s\t%s\t%s\t%s\t%.3g\t%.3g\t%s\n", subject, name, reference, unit, tolerance, worst, place);
        if (fclose(file))
            fail_msg("%s: can't be written", path);
    }
    if (!(worst <= tolerance))
        fail_msg("%s, %s: off by %.4g %s (%s), %.4g are allowed", subject, name, worst, unit, place, tolerance);
}
