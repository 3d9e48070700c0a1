/* cli_duration.c -- see cli_duration.h. */
#include <stdio.h>

#include "cli_duration.h"

const char *cli_duration(double seconds, char out[CLI_DURATION_SIZE])
{
    /* A unit is left for the next one at 100 seconds, 100 minutes, 72 hours and 1000 days. */
    static const struct { double length, end; const char *name; } units[] = {
        {1, 99.5, "s"},
        {60, 5970, "min"},
        {3600, 257400, "h"},
        {86400, 8.64e7, "days"},
        {31557600, 3.15576e12, "years"},
    };
    enum { LAST = sizeof units / sizeof units[0] - 1 };
    int unit = 0;
    while (unit < LAST && !(seconds < units[unit].end))
        unit++;
    double value = seconds / units[unit].length;
    if (!(seconds < units[LAST].end))
        snprintf(out, CLI_DURATION_SIZE, "ages");
    else if (value < 9.95)
        snprintf(out, CLI_DURATION_SIZE, "%.2g %s", value, units[unit].name);
    else
        snprintf(out, CLI_DURATION_SIZE, "%.0f %s", value, units[unit].name);
    return out;
}
