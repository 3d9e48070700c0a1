/* test_special_files.c -- what a scene names in place of files and isn't one: pipes that nobody writes into, and devices
 * without an end, are refused and not waited for. Only the scene itself may come from a pipe.
 */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "scene_files.h"

/* Seconds after which somebody waits for a pipe. */
enum { PATIENCE = 20 };

#define NAMING(name)                                                                                                   \
    SCENE("<shape type=\"obj\"><string name=\"filename\" value=\"" name "\"/></shape>"),                               \
    SCENE("<shape type=\"ply\"><string name=\"filename\" value=\"" name "\"/></shape>"),                               \
    SCENE("<bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\""        \
          name "\"/></texture></bsdf>"),                                                                               \
    SCENE("<emitter type=\"envmap\"><string name=\"filename\" value=\"" name "\"/></emitter>"),                        \
    SCENE("<include filename=\"" name "\"/>")

/* Whoever hangs is ended by the alarm, and the file after it isn't tried. */
static void refuse(const char *const *texts, size_t count, const char *name) {
    brume_context *context;
    brume_scene *scene = NULL;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    for (size_t i = 0; i < count; i++) {
        alarm(PATIENCE);
        assert_int_equal(scene_files_load(context, texts[i], &scene), BRUME_ERROR_SCENE);
        alarm(0);
        const char *message = brume_context_message(context);
        assert_int_equal(strncmp(message, "scene.xml:2:", 12), 0);
        assert_non_null(strstr(message, name));
        assert_non_null(strstr(message, "Operation not supported"));
    }
    brume_context_destroy(context);
}

static void test_pipes(void **state) {
    (void)state;
    static const char *const texts[] = {NAMING("pipe")};
    assert_int_equal(mkfifo("pipe", 0600), 0);
    refuse(texts, sizeof texts / sizeof texts[0], "pipe");
    unlink("pipe");
}

static void test_devices(void **state) {
    (void)state;
    static const char *const texts[] = {NAMING("/dev/zero")};
    refuse(texts, sizeof texts / sizeof texts[0], "/dev/zero");
}

static void test_scene_from_a_pipe(void **state) {
    (void)state;
    static const char text[] = SCENE("<shape type=\"sphere\"/>");
    brume_context *context;
    brume_scene *scene = NULL;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    assert_int_equal(mkfifo("scene.pipe", 0600), 0);
    pid_t writer = fork();
    assert_true(writer >= 0);
    if (writer == 0) {
        int pipe = open("scene.pipe", O_WRONLY);
        _exit(pipe >= 0 && write(pipe, text, sizeof text - 1) == (ssize_t)(sizeof text - 1) ? 0 : 1);
    }
    alarm(PATIENCE);
    assert_int_equal(brume_scene_load(context, "scene.pipe", NULL, 0, &scene), BRUME_OK);
    alarm(0);
    int status;
    assert_int_equal(waitpid(writer, &status, 0), writer);
    assert_int_equal(status, 0);
    unlink("scene.pipe");
    brume_scene_destroy(scene);
    brume_context_destroy(context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pipes),
        cmocka_unit_test(test_devices),
        cmocka_unit_test(test_scene_from_a_pipe),
    };
    return cmocka_run_group_tests_name("special_files", tests, scene_files_enter, scene_files_leave);
}
