/* scene_files.c -- see scene_files.h. */
#include "scene_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#define MAX_FILES 64

static char folder[64], before[4096];
static char names[MAX_FILES][64];
static int name_count;
static brume_context *good_context;
char scene_files_warnings[2048];

static void keep_warnings(void *user, brume_log_level level, const char *message) {
    size_t used = strlen(scene_files_warnings);
    (void)user;
    if (level == BRUME_LOG_WARNING)
        snprintf(scene_files_warnings + used, sizeof scene_files_warnings - used, "%s\n", message);
}

int scene_files_enter(void **state) {
    (void)state;
    if (brume_context_create(&good_context) != BRUME_OK) return -1;
    brume_context_set_log(good_context, keep_warnings, NULL);
    if (!getcwd(before, sizeof before)) return -1;
    strcpy(folder, "/tmp/brume-test-XXXXXX");
    if (!mkdtemp(folder)) return -1;
    return chdir(folder);
}

int scene_files_leave(void **state) {
    (void)state;
    for (int i = 0; i < name_count; i++) remove(names[i]);
    for (int i = 0; i < name_count; i++) {
        char *slash = strchr(names[i], '/');
        if (!slash) continue;
        *slash = '\0';
        rmdir(names[i]);
    }
    name_count = 0;
    brume_context_destroy(good_context);
    if (chdir(before) != 0) return -1;
    return rmdir(folder);
}

static void remember(const char *name) {
    for (int i = 0; i < name_count; i++)
        if (strcmp(names[i], name) == 0) return;
    if (name_count == MAX_FILES || strlen(name) >= sizeof names[0]) abort();
    strcpy(names[name_count++], name);
}

void scene_files_write(const char *name, const char *text, size_t length) {
    char parent[64];
    const char *slash = strchr(name, '/');
    if (slash) {
        snprintf(parent, sizeof parent, "%.*s", (int)(slash - name), name);
        mkdir(parent, 0777);
    }
    remember(name);
    FILE *file = fopen(name, "wb");
    if (!file || fwrite(text, 1, length, file) != length || fclose(file) != 0) abort();
}

void scene_files_write_text(const char *name, const char *text) { scene_files_write(name, text, strlen(text)); }

brume_result scene_files_load(brume_context *context, const char *text, brume_scene **out) {
    scene_files_write_text("scene.xml", text);
    return brume_scene_load(context, "scene.xml", NULL, 0, out);
}

brume_scene *scene_files_good_with(const char *text, const brume_parameter *parameters, size_t count) {
    brume_scene *scene = NULL;
    scene_files_warnings[0] = '\0';
    scene_files_write_text("scene.xml", text);
    if (brume_scene_load(good_context, "scene.xml", parameters, count, &scene) != BRUME_OK)
        fail_msg("%s", brume_context_message(good_context));
    return scene;
}

brume_scene *scene_files_good(const char *text) { return scene_files_good_with(text, NULL, 0); }

void scene_files_near(const float *actual, const double *expected, int count, double relative) {
    for (int i = 0; i < count; i++)
        if (!(fabs(actual[i] - expected[i]) <= relative * fmax(fabs(expected[i]), 1e-3)))
            fail_msg("component %d is %.8g, not %.8g", i, actual[i], expected[i]);
}
