/* test_cached_renders.c -- renders whose programs come from the cache, and from entries and folders that are wrong. A
 * fault may cost time, never a picture: films are compared bit by bit with one that was rendered from source. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "ball.h"
#include "cache_folder.h"
#include "open_device.h"
#include "sha256.h"
#include "text.h"

enum { SIZE = 12, PIXELS = SIZE * SIZE };

static brume_scene *scene;
static float from_source[PIXELS * 3];

#define OK(call) assert_int_equal((call), BRUME_OK)

/* Renders with the narrowest program, which compiles soonest. Returns the statistics as of create. */
static brume_render_stats render_film(float *radiance) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render_stats stats;
    brume_render *render;
    desc.lanes = 1;
    desc.guides = 0;
    OK(brume_render_create(device, scene, &desc, &render));
    OK(brume_render_run(render, NULL, NULL));
    OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, PIXELS * 3));
    OK(brume_render_get_stats(render, &stats));
    brume_render_destroy(render);
    return stats;
}

static void expect_same_film(int cached) {
    static float film[PIXELS * 3];
    assert_int_equal(render_film(film).program_cached, cached);
    assert_memory_equal(film, from_source, sizeof film);
}

static int setup(void **state) {
    (void)state;
    if (cache_folder_make()) return -1;
    setenv("BRUME_CACHE_DIR", "", 1);
    if (brume_context_create(&context) || brume_device_open(context, BRUME_DEVICE_ANY, &device)) return -1;
    scene = ball_scene(context, SIZE, SIZE);
    assert_int_equal(render_film(from_source).program_cached, 0);
    double sum = 0;
    for (int i = 0; i < PIXELS * 3; i++) sum += from_source[i];
    assert_true(sum > 0);
    setenv("BRUME_CACHE_DIR", cache_folder, 1);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return cache_folder_remove();
}

static char *entry_of_render(void) {
    char command[160], *path = malloc(256);
    snprintf(command, sizeof command, "ls -d '%s'/*.program", cache_folder);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    assert_non_null(fgets(path, 256, pipe));
    path[strcspn(path, "\n")] = 0;
    pclose(pipe);
    return path;
}

static void a_second_render_comes_from_the_cache(void **state) {
    (void)state;
    static float film[PIXELS * 3];
    cache_folder_clear();
    assert_int_equal(render_film(film).program_cached, 0);
    assert_int_equal(cache_folder_entries(), 1);
    brume_render_stats stats = render_film(film);
    assert_int_equal(stats.program_cached, 1);
    assert_true(stats.program_bytes > 10000);
    assert_memory_equal(film, from_source, sizeof film);
}

/* Damage of an entry that was good a moment ago: noticed, rendered from source, repaired. */
static void a_damaged_entry_costs_no_picture(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        cache_folder_clear();
        expect_same_film(0);
        expect_same_film(1);
        size_t size;
        char *path = entry_of_render();
        unsigned char *data = (unsigned char *)brume_text_read_file(path, &size);
        uint32_t facts_size;
        memcpy(&facts_size, data + 12, sizeof facts_size);
        if (kind == 0) data[size / 2] ^= 16;
        if (kind == 1) size /= 2;
        if (kind == 2) { /* another device's */
            char *name = strstr((char *)data + ENTRY_HEADER, "device: ");
            assert_non_null(name);
            name[8] ^= 1;
            entry_seal(data, size);
        }
        if (kind == 3) { /* whole by all signs, but no driver's: it has to be refused there */
            memset(data + ENTRY_HEADER + facts_size, 'x', size - ENTRY_HEADER - facts_size - SHA256_SIZE);
            entry_seal(data, size);
        }
        FILE *file = fopen(path, "wb");
        assert_non_null(file);
        assert_int_equal(fwrite(data, 1, size, file), size);
        fclose(file);
        expect_same_film(0);
        expect_same_film(1);
        free(data);
        free(path);
    }
}

static void a_folder_that_cannot_be_costs_no_picture(void **state) {
    (void)state;
    static const char *const folders[] = {"/proc/brume", "/dev/full", "/dev/null/brume", ""};
    static float film[PIXELS * 3];
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        setenv("BRUME_CACHE_DIR", folders[i], 1);
        for (int again = 0; again < 2; again++) {
            brume_render_stats stats = render_film(film);
            assert_int_equal(stats.program_cached, 0);
            assert_int_equal(stats.program_bytes, 0);
            assert_memory_equal(film, from_source, sizeof film);
        }
    }
    setenv("BRUME_CACHE_DIR", cache_folder, 1);
}

/* Two programs begin at once with an empty cache: both render, neither spoils the other's entry. */
static void two_processes_start_at_once(void **state) {
    (void)state;
    const char *build = getenv("BRUME_BUILD");
    if (!build) skip();
    char command[1024];
    cache_folder_clear();
    snprintf(command, sizeof command,
             "for i in 1 2; do %s/render-cli scenes/furnace.xml --lanes 1 --spp 1 -q -o %s/$i.png & done; wait; "
             "%s/render-cli scenes/furnace.xml --lanes 1 --spp 1 -q -o %s/3.png --stats json | "
             "grep -q '\"program_cached\":true' && cmp %s/1.png %s/2.png && cmp %s/1.png %s/3.png",
             build, cache_parent, build, cache_parent, cache_parent, cache_parent, cache_parent, cache_parent);
    assert_int_equal(system(command), 0);
    assert_int_equal(cache_folder_entries(), 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_second_render_comes_from_the_cache),
        cmocka_unit_test(a_damaged_entry_costs_no_picture),
        cmocka_unit_test(a_folder_that_cannot_be_costs_no_picture),
        cmocka_unit_test(two_processes_start_at_once),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
