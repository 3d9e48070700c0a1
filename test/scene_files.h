/* scene_files.h -- scene files for tests: a temporary working directory, so that messages name files without a path. */
#ifndef SCENE_FILES_H
#define SCENE_FILES_H

#include "scene.h"

#include <stddef.h>

#define SCENE(body) "<scene version=\"3.0.0\">\n" body "\n</scene>\n"

/* Makes a new folder and enters it, and a context that keeps warnings. 0 on success, as the group fixtures of cmocka
 * want it. */
int scene_files_enter(void **state);
/* Leaves it and removes it with everything that scene_files_write wrote. */
int scene_files_leave(void **state);

/* `name` may lie in a folder of one level, which is made. The text may hold zeros. */
void scene_files_write(const char *name, const char *text, size_t length);
void scene_files_write_text(const char *name, const char *text);

/* Writes scene.xml and loads it. */
brume_result scene_files_load(brume_context *context, const char *text, brume_scene **out);

/* The same of a file that must be right; the test fails otherwise. The caller destroys the scene. */
brume_scene *scene_files_good(const char *text);
brume_scene *scene_files_good_with(const char *text, const brume_parameter *parameters, size_t count);
/* What it warned of, a line each. */
extern char scene_files_warnings[2048];

/* Each within a relative error. */
void scene_files_near(const float *actual, const double *expected, int count, double relative);
#define NEAR(actual, relative, ...)                                                                                    \
    do {                                                                                                               \
        const double expected_[] = {__VA_ARGS__};                                                                      \
        scene_files_near(actual, expected_, (int)(sizeof expected_ / sizeof expected_[0]), relative);                  \
    } while (0)

#endif
