/* measure_exhaustive.c -- the device's functions over all their inputs: 2^32 floats, 2^24 or 2^32 variates, a grid of
 * pairs. Half an hour or less on two cores.
 *
 *     measure_exhaustive TABLE.md [NAME...]
 *
 * writes the table, or replaces the rows of the functions named in it. Fails if one exceeds the bound that
 * function_cases_*.c states, which test_functions holds samples to.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "function_sweep.h"
#include "platform.h"
#include "text.h"

enum { ROW = 512, MAX_ROWS = 128 };

static char rows[MAX_ROWS][ROW];
static const char *current;
static double last_told;

static void progress(double share) {
    double now = brume_seconds();
    if (now - last_told < 1) return;
    last_told = now;
    fprintf(stderr, "\r%-40s %3.0f %%", current, 100 * share);
}

static int is_row_of(const char *line, const char *name) {
    size_t length = strlen(name);
    if (strncmp(line, "| ", 2) != 0 || strncmp(line + 2, name, length) != 0) return 0;
    return strncmp(line + 2 + length, " |", 2) == 0;
}

/* The rows that an earlier run has left. */
static void read_rows(const char *path) {
    char *text = brume_text_read_file(path, NULL);
    for (char *line = text ? strtok(text, "\n") : NULL; line; line = strtok(NULL, "\n"))
        for (uint32_t i = 0; function_case_at(i) && i < MAX_ROWS; i++)
            if (is_row_of(line, function_case_at(i)->name)) snprintf(rows[i], ROW, "%s", line);
    free(text);
}

static int write_rows(const char *path) {
    FILE *file = fopen(path, "w");
    if (!file) return 0;
    fprintf(file, "The device's functions over all their inputs, in float, against exact values: written by\n"
                  "`make exhaustive`. What is compared how: [function_cases.h](function_cases.h).\n\n"
                  "| function | inputs | compared | worst error | unit | where | its value | reference |\n"
                  "|---|---|--:|--:|---|---|--:|---|\n");
    for (uint32_t i = 0; i < MAX_ROWS; i++)
        if (rows[i][0]) fprintf(file, "%s\n", rows[i]);
    return fclose(file) == 0;
}

static int measure(function_sweep *sweep, brume_context *context, uint32_t index) {
    const function_case *c = function_case_at(index);
    function_worst worst;
    char place[128];
    double start = brume_seconds();
    current = c->name;
    if (function_sweep_all(sweep, c, progress, &worst) != BRUME_OK) {
        fprintf(stderr, "%s\n", brume_context_message(context));
        return 0;
    }
    function_worst_place(c, &worst, place, sizeof place);
    snprintf(rows[index], ROW, "| %s | %s | %llu | %.4g | %s | %s | %.9g | %s |", c->name, c->domain,
             (unsigned long long)worst.compared, worst.error, c->unit, place, (double)worst.at.y, c->reference);
    int kept = worst.error <= c->bound;
    fprintf(stderr, "\r%-40s %.4g %s at %s%s (%.0f s)\n", c->name, worst.error, c->unit, place,
            kept ? "" : ": beyond its bound", brume_seconds() - start);
    return kept;
}

static int is_asked_for(const function_case *c, char **names, int count) {
    for (int i = 0; i < count; i++)
        if (strcmp(c->name, names[i]) == 0) return 1;
    return count == 0;
}

int main(int argc, char **argv) {
    if (argc < 2) {
        fprintf(stderr, "usage: measure_exhaustive TABLE.md [NAME...]\n");
        return 2;
    }
    brume_context *context = NULL;
    brume_device *device = NULL;
    function_sweep *sweep = NULL;
    int good = brume_context_create(&context) == BRUME_OK &&
               brume_device_open(context, BRUME_DEVICE_ANY, &device) == BRUME_OK &&
               function_sweep_create(context, device, NULL, &sweep) == BRUME_OK;
    if (!good) fprintf(stderr, "%s\n", context ? brume_context_message(context) : "out of memory");
    read_rows(argv[1]);
    for (uint32_t i = 0; sweep && function_case_at(i) && i < MAX_ROWS; i++) {
        if (!is_asked_for(function_case_at(i), argv + 2, argc - 2)) continue;
        good = measure(sweep, context, i) && good;
        if (!write_rows(argv[1])) {
            fprintf(stderr, "%s can't be written\n", argv[1]);
            good = 0;
        }
    }
    function_sweep_destroy(sweep);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return good ? 0 : 1;
}
