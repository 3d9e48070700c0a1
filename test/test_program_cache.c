/* test_program_cache.c -- the cache of compiled programs: what it keeps, and every way an entry can be wrong. What
 * renders make of such entries: test_cached_renders.c. */
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

#include "cache_folder.h"
#include "program_cache.h"
#include "sha256.h"
#include "text.h"

/* Entries of the test's own. */
static const char facts[] = "brume: 0.1.0\ndevice: a machine\noptions: -DX=1\nsource: 00ff\n";
static const unsigned char binary[] = "machine code, as it were, of some length";

static unsigned char *read_entry(const char *of, size_t *size) {
    char *path = brume_program_cache_path(cache_folder, of);
    unsigned char *data = (unsigned char *)brume_text_read_file(path, size);
    free(path);
    assert_non_null(data);
    return data;
}

static void write_entry(const char *of, const unsigned char *data, size_t size) {
    char *path = brume_program_cache_path(cache_folder, of);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    free(path);
}

static int loads(const char *of) {
    size_t size = 0;
    unsigned char *loaded = brume_program_cache_load(cache_folder, of, &size);
    int right = loaded && size == sizeof binary && memcmp(loaded, binary, size) == 0;
    free(loaded);
    return loaded ? right ? 1 : -1 : 0;
}

static void store(void) {
    assert_true(brume_program_cache_store(cache_folder, facts, binary, sizeof binary, PROGRAM_CACHE_LIMIT));
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
        entry_seal(data, size);
        write_entry(facts, data, size);
        if (loads(facts) == -1) resealed++;
        data[bit / 8] ^= (unsigned char)(1 << bit % 8);
        entry_seal(data, size);
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
        memcpy(data + ENTRY_HEADER, other, sizeof facts - 1);
        entry_seal(data, size);
        write_entry(facts, data, size);
        assert_int_equal(loads(facts), 0);
        write_entry(other, data, size); /* under its own name it is right */
        assert_int_equal(loads(other), 1);
        free(data);
    }
    store();
    unsigned char *data = read_entry(facts, &size);
    data[8] ^= 3; /* an older format */
    entry_seal(data, size);
    write_entry(facts, data, size);
    assert_int_equal(loads(facts), 0);
    free(data);
}

static void entries_are_private(void **state) {
    (void)state;
    struct stat info;
    cache_folder_clear();
    store();
    char *path = brume_program_cache_path(cache_folder, facts);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0600);
    assert_int_equal(stat(cache_folder, &info), 0);
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
    cache_folder_clear();
    for (int i = 0; i < COUNT; i++) {
        snprintf(names[i], sizeof names[i], "facts %d", i);
        assert_true(brume_program_cache_store(cache_folder, names[i], bytes, BYTES, PROGRAM_CACHE_LIMIT));
        char *path = brume_program_cache_path(cache_folder, names[i]);
        set_age(path, 100 - i);
        free(path);
    }
    unsigned char *used = brume_program_cache_load(cache_folder, names[0], &size);
    assert_non_null(used);
    free(used);
    char *orphan = brume_program_cache_path(cache_folder, "an orphan");
    char *young = brume_program_cache_path(cache_folder, "young");
    orphan = strcat(realloc(orphan, strlen(orphan) + 8), ".Ab1234");
    young = strcat(realloc(young, strlen(young) + 8), ".Ab1234");
    close(open(orphan, O_CREAT | O_WRONLY, 0600));
    close(open(young, O_CREAT | O_WRONLY, 0600));
    set_age(orphan, 2 * 60 * 60);
    strcpy(names[COUNT], "one more");
    assert_true(brume_program_cache_store(cache_folder, names[COUNT], bytes, BYTES, 3500)); /* room for three */
    static const int left[COUNT + 1] = {1, 0, 0, 0, 1, 1};
    for (int i = 0; i <= COUNT; i++) {
        unsigned char *data = brume_program_cache_load(cache_folder, names[i], &size);
        assert_int_equal(data != NULL, left[i]);
        free(data);
    }
    assert_int_not_equal(access(orphan, F_OK), 0);
    assert_int_equal(access(young, F_OK), 0);
    free(orphan);
    free(young);
    assert_false(brume_program_cache_store(cache_folder, "too large", bytes, BYTES, 1500));
}

/* As if the disk were full: no file grows beyond half an entry. The signal that comes with it must not end us. */
static void a_full_disk_leaves_nothing_behind(void **state) {
    (void)state;
    static unsigned char bytes[8192];
    cache_folder_clear();
    store();
    struct rlimit before, limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    limit = before;
    limit.rlim_cur = 4096;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    int kept = brume_program_cache_store(cache_folder, "large", bytes, sizeof bytes, PROGRAM_CACHE_LIMIT);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_false(kept);
    assert_int_equal(cache_folder_entries(), 1);
    sigset_t pending;
    assert_int_equal(sigpending(&pending), 0);
    assert_false(sigismember(&pending, SIGXFSZ));
    assert_true(brume_program_cache_store(cache_folder, "large", bytes, sizeof bytes, PROGRAM_CACHE_LIMIT));
    assert_int_equal(cache_folder_entries(), 2);
}

/* Writers and readers of one entry: whoever loads gets one writer's bytes whole. */
static void processes_share_an_entry(void **state) {
    (void)state;
    enum { PROCESSES = 4, ROUNDS = 30, BYTES = 300000 };
    pid_t children[PROCESSES];
    cache_folder_clear();
    for (int k = 0; k < PROCESSES; k++) {
        children[k] = fork();
        assert_true(children[k] >= 0);
        if (children[k] > 0) continue;
        unsigned char *bytes = malloc(BYTES);
        int bad = !bytes;
        for (int i = 0; i < ROUNDS && !bad; i++) {
            size_t size = 0;
            memset(bytes, 1 + k, BYTES);
            bad |= !brume_program_cache_store(cache_folder, "shared", bytes, BYTES, PROGRAM_CACHE_LIMIT);
            unsigned char *data = brume_program_cache_load(cache_folder, "shared", &size);
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
    assert_int_equal(cache_folder_entries(), 1);
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
    setenv("BRUME_CACHE_DIR", cache_folder, 1);
}

static int setup(void **state) {
    (void)state;
    return cache_folder_make();
}

static int teardown(void **state) {
    (void)state;
    return cache_folder_remove();
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
        cmocka_unit_test(the_folder_is_where_the_user_wants_it),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
