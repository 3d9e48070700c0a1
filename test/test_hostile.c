/* test_hostile.c -- files from anywhere: whatever is in them, the readers come back with a result or an error, and
 * write nowhere. The files are those that fuzzing starts from, those that it has found (fuzz/found/), and all of these
 * with bytes changed, dropped, doubled and swapped between them. `make fuzz` goes on from there.
 */
#include <dirent.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "device_test.h"
#include "fuzz/guard.h"
#include "fuzz/targets.h"

enum { MOST_FILES = 256, MUTATIONS = 150, MOST_BYTES = 1 << 16 };

typedef struct input {
    uint8_t *bytes;
    size_t size;
} input;

static char folder[] = "/tmp/brume-hostile-XXXXXX";

static int setup(void **state) {
    (void)state;
    return mkdtemp(folder) && fuzz_write_seeds(folder) ? 0 : -1;
}

static int teardown(void **state) {
    char command[128];
    (void)state;
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static int is_input(const struct dirent *entry) { return entry->d_name[0] != '.'; }

/* In the order of their names, so that the mutations, which go from file to file, are the same wherever it runs. */
static int by_name(const struct dirent **a, const struct dirent **b) { return strcmp((*a)->d_name, (*b)->d_name); }

static size_t read_inputs(const char *parent, const char *target, input *out, size_t count) {
    char path[1024];
    struct dirent **names = NULL;
    snprintf(path, sizeof path, "%s/%s", parent, target);
    int found = scandir(path, &names, is_input, by_name);
    for (int i = 0; i < found; i++) {
        assert_true(count < MOST_FILES);
        snprintf(path, sizeof path, "%s/%s/%s", parent, target, names[i]->d_name);
        FILE *file = fopen(path, "rb");
        assert_non_null(file);
        input in = {malloc(MOST_BYTES), 0};
        assert_non_null(in.bytes);
        in.size = fread(in.bytes, 1, MOST_BYTES, file);
        fclose(file);
        out[count++] = in;
        free(names[i]);
    }
    free(names);
    return count;
}

/* In place; the size stays below MOST_BYTES. */
static size_t mutate(uint8_t *bytes, size_t size, const input *other, uint64_t *random) {
    size_t at = size ? test_random_bits(random) % size : 0, length = 1 + test_random_bits(random) % 16;
    if (size == 0) return 0;
    if (length > size - at) length = size - at;
    switch (test_random_bits(random) % 7) {
    case 0: bytes[at] = (uint8_t)test_random_bits(random); break;
    case 1: bytes[at] ^= (uint8_t)(1 << test_random_bits(random) % 8); break;
    case 2: memset(bytes + at, test_random_bits(random) % 2 ? 0xff : 0, length); break;
    case 3: /* dropped */
        memmove(bytes + at, bytes + at + length, size - at - length);
        return size - length;
    case 4: /* doubled */
        if (size + length > MOST_BYTES) break;
        memmove(bytes + at + length, bytes + at, size - at);
        return size + length;
    case 5: return at; /* cut off */
    default: /* from another file */
        if (length > other->size) length = other->size;
        memcpy(bytes + at, other->bytes + test_random_bits(random) % (other->size - length + 1), length);
    }
    return size;
}

static void try_target(const fuzz_target *target) {
    static input inputs[MOST_FILES];
    uint8_t *bytes = malloc(MOST_BYTES);
    uint64_t random = 1;
    size_t count = read_inputs(folder, target->name, inputs, 0), tried = 0;
    assert_non_null(bytes);
    assert_true(count > 0);
    count = read_inputs("test/fuzz/found", target->name, inputs, count);
    for (size_t i = 0; i < count; i++, tried++) target->run(inputs[i].bytes, inputs[i].size);
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < MUTATIONS; k++, tried++) {
            size_t size = inputs[i].size;
            memcpy(bytes, inputs[i].bytes, size);
            for (int n = 0; n <= k % 4; n++)
                size = mutate(bytes, size, &inputs[test_random_bits(&random) % count], &random);
            target->run(bytes, size);
        }
    for (size_t i = 0; i < count; i++) free(inputs[i].bytes);
    free(bytes);
    print_message("%s: %zu files, %zu readings\n", target->name, count, tried);
}

static void test_scenes(void **state) { (void)state; try_target(&fuzz_targets[0]); }
static void test_obj(void **state) { (void)state; try_target(&fuzz_targets[1]); }
static void test_ply(void **state) { (void)state; try_target(&fuzz_targets[2]); }
static void test_pictures(void **state) { (void)state; try_target(&fuzz_targets[3]); }
static void test_checkpoints(void **state) { (void)state; try_target(&fuzz_targets[4]); }

/* The guard itself: a process that opens a file for writing while it is on is ended. */
static void test_writing_would_be_noticed(void **state) {
    (void)state;
    char path[128];
    snprintf(path, sizeof path, "%s/new", folder);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        signal(SIGABRT, SIG_DFL);
        if (!freopen("/dev/null", "w", stderr)) _exit(2);
        guard_begin();
        FILE *file = fopen(path, "w");
        _exit(file ? 0 : 1);
    }
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
    assert_int_not_equal(access(path, F_OK), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scenes),      cmocka_unit_test(test_obj),
        cmocka_unit_test(test_ply),         cmocka_unit_test(test_pictures),
        cmocka_unit_test(test_checkpoints), cmocka_unit_test(test_writing_would_be_noticed),
    };
    return cmocka_run_group_tests_name("hostile", tests, setup, teardown);
}
