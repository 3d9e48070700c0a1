/* test_program_cache.c -- the cache of compiled programs: what it keeps, and every way an entry can be wrong. A fault
 * may cost time, never a picture: films are compared bit by bit with one that was rendered from source. */
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "ball.h"
#include "open_device.h"
#include "program_cache.h"
#include "sha256.h"
#include "text.h"

enum { SIZE = 12, PIXELS = SIZE * SIZE, HEADER = 24 };

static char folder[] = "/tmp/brume-cache-XXXXXX";
static char cache[64]; /* a folder in it, for the cache to make */
static brume_scene *scene;
static float from_source[PIXELS * 3];

#define OK(call) assert_int_equal((call), BRUME_OK)

static void clear_cache(void) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", cache);
    assert_int_equal(system(command), 0);
}

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
    if (!mkdtemp(folder)) return -1;
    snprintf(cache, sizeof cache, "%s/a/brume", folder);
    setenv("BRUME_CACHE_DIR", "", 1);
    if (brume_context_create(&context) || brume_device_open(context, BRUME_DEVICE_ANY, &device)) return -1;
    scene = ball_scene(context, SIZE, SIZE);
    assert_int_equal(render_film(from_source).program_cached, 0);
    double sum = 0;
    for (int i = 0; i < PIXELS * 3; i++) sum += from_source[i];
    assert_true(sum > 0);
    setenv("BRUME_CACHE_DIR", cache, 1);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return system(command);
}

/* ---- entries of the test's own: the format as program_cache.c describes it ------------------------------------- */

static const char facts[] = "brume: 0.1.0\ndevice: a machine\noptions: -DX=1\nsource: 00ff\n";
static const unsigned char binary[] = "machine code, as it were, of some length";

static unsigned char *read_entry(const char *of, size_t *size) {
    char *path = brume_program_cache_path(cache, of);
    unsigned char *data = (unsigned char *)brume_text_read_file(path, size);
    free(path);
    assert_non_null(data);
    return data;
}

static void write_entry(const char *of, const unsigned char *data, size_t size) {
    char *path = brume_program_cache_path(cache, of);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    free(path);
}

static void seal(unsigned char *data, size_t size) {
    brume_sha256(data, size - SHA256_SIZE, data + size - SHA256_SIZE);
}

static int loads(const char *of) {
    size_t size = 0;
    unsigned char *loaded = brume_program_cache_load(cache, of, &size);
    int right = loaded && size == sizeof binary && memcmp(loaded, binary, size) == 0;
    free(loaded);
    return loaded ? right ? 1 : -1 : 0;
}

static void store(void) {
    assert_true(brume_program_cache_store(cache, facts, binary, sizeof binary, PROGRAM_CACHE_LIMIT));
    assert_int_equal(loads(facts), 1);
}

static void digests_are_those_of_the_standard(void **state) {
    (void)state;
    static const struct { const char *text, *digest; } known[] = {
        {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
        {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
        {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        uint8_t digest[SHA256_SIZE];
        char hex[2 * SHA256_SIZE + 1];
        brume_sha256(known[i].text, strlen(known[i].text), digest);
        for (int k = 0; k < SHA256_SIZE; k++) snprintf(hex + 2 * k, 3, "%02x", digest[k]);
        assert_string_equal(hex, known[i].digest);
    }
}

static void truncated_entries_are_refused(void **state) {
    (void)state;
    size_t size;
    store();
    unsigned char *data = read_entry(facts, &size);
    for (size_t cut = 0; cut < size; cut++) {
        write_entry(facts, data, cut);
        assert_int_equal(loads(facts), 0);
    }
    data = realloc(data, size + 1);
    data[size] = 0;
    write_entry(facts, data, size + 1);
    assert_int_equal(loads(facts), 0);
    write_entry(facts, data, size);
    assert_int_equal(loads(facts), 1);
    free(data);
}

/* Every single bit matters, and where the binary differs it is the digest alone that tells. */
static void flipped_bits_are_refused(void **state) {
    (void)state;
    size_t size, resealed = 0;
    store();
    unsigned char *data = read_entry(facts, &size);
    for (size_t bit = 0; bit < 8 * size; bit++) {
        data[bit / 8] ^= (unsigned char)(1 << bit % 8);
        write_entry(facts, data, size);
        assert_int_equal(loads(facts), 0);
        seal(data, size);
        write_entry(facts, data, size);
        if (loads(facts) == -1) resealed++;
        data[bit / 8] ^= (unsigned char)(1 << bit % 8);
        seal(data, size);
    }
    assert_int_equal(resealed, 8 * sizeof binary);
    free(data);
}

/* Whole entries, but another device's, or of another version. */
static void foreign_entries_are_refused(void **state) {
    (void)state;
    size_t size;
    static const char *const swaps[][2] = {{"a machine", "b machine"}, {"0.1.0", "0.0.9"}, {"X=1", "X=2"}};
    for (size_t i = 0; i < sizeof swaps / sizeof *swaps; i++) {
        store();
        unsigned char *data = read_entry(facts, &size);
        char other[sizeof facts];
        memcpy(other, facts, sizeof facts);
        memcpy(strstr(other, swaps[i][0]), swaps[i][1], strlen(swaps[i][1]));
        memcpy(data + HEADER, other, sizeof facts - 1);
        seal(data, size);
        write_entry(facts, data, size);
        assert_int_equal(loads(facts), 0);
        write_entry(other, data, size); /* under its own name it is right */
        assert_int_equal(loads(other), 1);
        free(data);
    }
    store();
    unsigned char *data = read_entry(facts, &size);
    data[8] ^= 3; /* an older format */
    seal(data, size);
    write_entry(facts, data, size);
    assert_int_equal(loads(facts), 0);
    free(data);
}

static void entries_are_private(void **state) {
    (void)state;
    struct stat info;
    clear_cache();
    store();
    char *path = brume_program_cache_path(cache, facts);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0600);
    assert_int_equal(stat(cache, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0700);
    free(path);
}

static void set_age(const char *path, time_t seconds) {
    struct timespec times[2];
    clock_gettime(CLOCK_REALTIME, &times[0]);
    times[0].tv_sec -= seconds;
    times[1] = times[0];
    assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
}

/* Least recently used first; a load counts as use. */
static void old_entries_make_room(void **state) {
    (void)state;
    enum { COUNT = 5, BYTES = 1000 };
    static unsigned char bytes[BYTES];
    char names[COUNT + 1][16];
    size_t size;
    clear_cache();
    for (int i = 0; i < COUNT; i++) {
        snprintf(names[i], sizeof names[i], "facts %d", i);
        assert_true(brume_program_cache_store(cache, names[i], bytes, BYTES, PROGRAM_CACHE_LIMIT));
        char *path = brume_program_cache_path(cache, names[i]);
        set_age(path, 100 - i);
        free(path);
    }
    unsigned char *used = brume_program_cache_load(cache, names[0], &size);
    assert_non_null(used);
    free(used);
    char *orphan = brume_program_cache_path(cache, "an orphan"), *young = brume_program_cache_path(cache, "young");
    orphan = strcat(realloc(orphan, strlen(orphan) + 8), ".Ab1234");
    young = strcat(realloc(young, strlen(young) + 8), ".Ab1234");
    close(open(orphan, O_CREAT | O_WRONLY, 0600));
    close(open(young, O_CREAT | O_WRONLY, 0600));
    set_age(orphan, 2 * 60 * 60);
    strcpy(names[COUNT], "one more");
    assert_true(brume_program_cache_store(cache, names[COUNT], bytes, BYTES, 3500)); /* room for three */
    static const int left[COUNT + 1] = {1, 0, 0, 0, 1, 1};
    for (int i = 0; i <= COUNT; i++) {
        unsigned char *data = brume_program_cache_load(cache, names[i], &size);
        assert_int_equal(data != NULL, left[i]);
        free(data);
    }
    assert_int_not_equal(access(orphan, F_OK), 0);
    assert_int_equal(access(young, F_OK), 0);
    free(orphan);
    free(young);
    assert_false(brume_program_cache_store(cache, "too large", bytes, BYTES, 1500));
}

static int files_in_cache(void) {
    char command[128], answer[16] = "";
    snprintf(command, sizeof command, "ls -A '%s' | wc -l", cache);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    assert_non_null(fgets(answer, sizeof answer, pipe));
    pclose(pipe);
    return atoi(answer);
}

/* As if the disk were full: no file grows beyond half an entry. The signal that comes with it must not end us. */
static void a_full_disk_leaves_nothing_behind(void **state) {
    (void)state;
    static unsigned char bytes[8192];
    clear_cache();
    store();
    struct rlimit before, limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    limit = before;
    limit.rlim_cur = 4096;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    int kept = brume_program_cache_store(cache, "large", bytes, sizeof bytes, PROGRAM_CACHE_LIMIT);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_false(kept);
    assert_int_equal(files_in_cache(), 1);
    sigset_t pending;
    assert_int_equal(sigpending(&pending), 0);
    assert_false(sigismember(&pending, SIGXFSZ));
    assert_true(brume_program_cache_store(cache, "large", bytes, sizeof bytes, PROGRAM_CACHE_LIMIT));
    assert_int_equal(files_in_cache(), 2);
}

/* Writers and readers of one entry: whoever loads gets one writer's bytes whole. */
static void processes_share_an_entry(void **state) {
    (void)state;
    enum { PROCESSES = 4, ROUNDS = 30, BYTES = 300000 };
    pid_t children[PROCESSES];
    clear_cache();
    for (int k = 0; k < PROCESSES; k++) {
        children[k] = fork();
        assert_true(children[k] >= 0);
        if (children[k] > 0) continue;
        unsigned char *bytes = malloc(BYTES);
        int bad = !bytes;
        for (int i = 0; i < ROUNDS && !bad; i++) {
            size_t size = 0;
            memset(bytes, 1 + k, BYTES);
            bad |= !brume_program_cache_store(cache, "shared", bytes, BYTES, PROGRAM_CACHE_LIMIT);
            unsigned char *data = brume_program_cache_load(cache, "shared", &size);
            bad |= !data || size != BYTES;
            for (size_t b = 0; !bad && b < size; b++) bad = data[b] != data[0];
            free(data);
        }
        _exit(bad);
    }
    for (int k = 0; k < PROCESSES; k++) {
        int status;
        assert_int_equal(waitpid(children[k], &status, 0), children[k]);
        assert_int_equal(status, 0);
    }
    assert_int_equal(files_in_cache(), 1);
}

/* ---- renders --------------------------------------------------------------------------------------------------- */

static char *entry_of_render(void) {
    char command[160], *path = malloc(256);
    snprintf(command, sizeof command, "ls -d '%s'/*.program", cache);
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
    clear_cache();
    assert_int_equal(render_film(film).program_cached, 0);
    assert_int_equal(files_in_cache(), 1);
    brume_render_stats stats = render_film(film);
    assert_int_equal(stats.program_cached, 1);
    assert_true(stats.program_bytes > 10000);
    assert_memory_equal(film, from_source, sizeof film);
}

/* Damage of an entry that was good a moment ago: noticed, rendered from source, repaired. */
static void a_damaged_entry_costs_no_picture(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        clear_cache();
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
            char *name = strstr((char *)data + HEADER, "device: ");
            assert_non_null(name);
            name[8] ^= 1;
            seal(data, size);
        }
        if (kind == 3) { /* whole by all signs, but no driver's: it has to be refused there */
            memset(data + HEADER + facts_size, 'x', size - HEADER - facts_size - SHA256_SIZE);
            seal(data, size);
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
    setenv("BRUME_CACHE_DIR", cache, 1);
}

static void the_folder_is_where_the_user_wants_it(void **state) {
    (void)state;
    char *home = getenv("HOME"), *path, expected[512];
    unsetenv("BRUME_CACHE_DIR");
    setenv("XDG_CACHE_HOME", "/x/y", 1);
    path = brume_program_cache_folder();
    assert_string_equal(path, "/x/y/brume");
    free(path);
    unsetenv("XDG_CACHE_HOME");
    path = brume_program_cache_folder();
    snprintf(expected, sizeof expected, "%s/.cache/brume", home ? home : "");
    if (home && *home) assert_string_equal(path, expected);
    free(path);
    setenv("BRUME_CACHE_DIR", "", 1);
    assert_null(brume_program_cache_folder());
    setenv("BRUME_CACHE_DIR", cache, 1);
}

/* Two programs begin at once with an empty cache: both render, neither spoils the other's entry. */
static void two_processes_start_at_once(void **state) {
    (void)state;
    const char *build = getenv("BRUME_BUILD");
    if (!build) skip();
    char command[1024];
    clear_cache();
    snprintf(command, sizeof command,
             "for i in 1 2; do %s/render-cli scenes/furnace.xml --lanes 1 --spp 1 -q -o %s/$i.png & done; wait; "
             "%s/render-cli scenes/furnace.xml --lanes 1 --spp 1 -q -o %s/3.png --stats json | "
             "grep -q '\"program_cached\":true' && cmp %s/1.png %s/2.png && cmp %s/1.png %s/3.png",
             build, folder, build, folder, folder, folder, folder, folder);
    assert_int_equal(system(command), 0);
    assert_int_equal(files_in_cache(), 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(digests_are_those_of_the_standard),
        cmocka_unit_test(truncated_entries_are_refused),
        cmocka_unit_test(flipped_bits_are_refused),
        cmocka_unit_test(foreign_entries_are_refused),
        cmocka_unit_test(entries_are_private),
        cmocka_unit_test(old_entries_make_room),
        cmocka_unit_test(a_full_disk_leaves_nothing_behind),
        cmocka_unit_test(processes_share_an_entry),
        cmocka_unit_test(a_second_render_comes_from_the_cache),
        cmocka_unit_test(a_damaged_entry_costs_no_picture),
        cmocka_unit_test(a_folder_that_cannot_be_costs_no_picture),
        cmocka_unit_test(the_folder_is_where_the_user_wants_it),
        cmocka_unit_test(two_processes_start_at_once),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
