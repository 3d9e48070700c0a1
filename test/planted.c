/* planted.c -- see planted.h. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "planted.h"
#include "program.h"

static char folder[64];

static void path_of(const char *name, char path[192]) { snprintf(path, 192, "%s/%s", folder, name); }

static void write_file(const char *name, const char *start, size_t length, const char *middle, const char *rest) {
    char path[192];
    path_of(name, path);
    FILE *file = fopen(path, "w");
    if (!file || fwrite(start, 1, length, file) != length || fputs(middle, file) < 0 || fputs(rest, file) < 0 ||
        fclose(file) != 0)
        fail_msg("%s can't be written", path);
}

void planted_bug(const char *file, const char *right, const char *wrong) {
    int found = 0;
    planted_remove();
    strcpy(folder, "/tmp/brume-planted-XXXXXX");
    if (!mkdtemp(folder)) {
        folder[0] = '\0';
        fail_msg("no temporary folder");
    }
    for (const brume_source *s = brume_sources; s->name; s++) {
        const char *at = strcmp(s->name, file) == 0 ? strstr(s->text, right) : NULL;
        found += at && !strstr(at + 1, right);
        if (at)
            write_file(s->name, s->text, (size_t)(at - s->text), wrong, at + strlen(right));
        else
            write_file(s->name, s->text, strlen(s->text), "", "");
    }
    if (found != 1) {
        planted_remove();
        fail_msg("%s holds not once: %s", file, right);
    }
    setenv("BRUME_CL_DIR", folder, 1);
}

void planted_remove(void) {
    if (!folder[0])
        return;
    for (const brume_source *s = brume_sources; s->name; s++) {
        char path[192];
        path_of(s->name, path);
        remove(path);
    }
    rmdir(folder);
    folder[0] = '\0';
    unsetenv("BRUME_CL_DIR");
}
