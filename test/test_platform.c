/* test_platform.c -- what lib/platform.h promises. Windows' side of it: `make check-mingw`. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <errno.h>

#include <cmocka.h>

#include "platform.h"

static char folder[512], path[600];

/* The path of a file of the test's folder. */
static const char *in_folder(const char *name) {
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int setup(void **state) {
    (void)state;
    const char *build = getenv("BRUME_BUILD");
    snprintf(folder, sizeof folder, "%s/test_platform-%ld/deeper", build ? build : "build", brume_process_number());
    brume_folder_make(folder);
    return 0;
}

static int count(void *user, const brume_folder_entry *entry) {
    (void)entry;
    ++*(int *)user;
    return 1;
}

static int remove_entry(void *user, const brume_folder_entry *entry) {
    (void)user;
    brume_folder_remove(folder, entry->name);
    return 1;
}

static int files(void) {
    int n = 0;
    brume_folder_visit(folder, count, &n);
    return n;
}

static int teardown(void **state) {
    (void)state;
    brume_folder_visit(folder, remove_entry, NULL);
    int left = files();
    remove(folder);
    folder[brume_path_folder(folder) - 1] = 0;
    remove(folder);
    return left;
}

/* ---- time and threads ------------------------------------------------------------------------------------------ */

static void time_goes_on(void **state) {
    (void)state;
    double before = brume_seconds();
    brume_sleep(0.02);
    double slept = brume_seconds() - before;
    assert_true(slept >= 0.019);
    assert_true(slept < 60);
}

static brume_lock lock = BRUME_LOCK_INIT;
static int counter;

enum { TURNS = 20000 };

static void add_turns(void *argument) {
    for (int i = 0; i < TURNS; i++) {
        brume_lock_exclusive(&lock);
        volatile int *c = argument;
        *c = *c + 1;
        brume_unlock_exclusive(&lock);
    }
}

static void an_exclusive_lock_excludes(void **state) {
    (void)state;
    brume_thread *threads[4];
    counter = 0;
    for (int i = 0; i < 4; i++) assert_non_null(threads[i] = brume_thread_start(add_turns, &counter));
    for (int i = 0; i < 4; i++) brume_thread_join(threads[i]);
    assert_int_equal(counter, 4 * TURNS);
    brume_thread_join(NULL);
}

static int inside, met;

/* Until the other is in, too; the time is for a lock that doesn't share. */
static void go_in(void *argument) {
    (void)argument;
    brume_lock_shared(&lock);
    __atomic_add_fetch(&inside, 1, __ATOMIC_ACQ_REL);
    for (int i = 0; i < 20000 && __atomic_load_n(&inside, __ATOMIC_ACQUIRE) < 2; i++) brume_sleep(0.001);
    if (__atomic_load_n(&inside, __ATOMIC_ACQUIRE) == 2) __atomic_add_fetch(&met, 1, __ATOMIC_ACQ_REL);
    brume_unlock_shared(&lock);
}

static void a_shared_lock_is_shared(void **state) {
    (void)state;
    inside = met = 0;
    brume_thread *a = brume_thread_start(go_in, NULL), *b = brume_thread_start(go_in, NULL);
    assert_non_null(a);
    assert_non_null(b);
    brume_thread_join(a);
    brume_thread_join(b);
    assert_int_equal(met, 2); /* both saw the other */
}

static int wanted, had, turns_meanwhile;

/* In again at once, so that hardly ever nobody is in. */
static void go_in_and_out(void *argument) {
    (void)argument;
    while (!__atomic_load_n(&had, __ATOMIC_ACQUIRE) && __atomic_load_n(&turns_meanwhile, __ATOMIC_ACQUIRE) < 4000) {
        brume_lock_shared(&lock);
        brume_sleep(0.001);
        if (__atomic_load_n(&wanted, __ATOMIC_ACQUIRE) && !__atomic_load_n(&had, __ATOMIC_ACQUIRE))
            __atomic_add_fetch(&turns_meanwhile, 1, __ATOMIC_ACQ_REL);
        brume_unlock_shared(&lock);
    }
}

static void who_wants_it_alone_gets_it(void **state) {
    enum { READERS = 8 };
    brume_thread *readers[READERS];
    (void)state;
    wanted = had = turns_meanwhile = 0;
    for (int i = 0; i < READERS; i++) assert_non_null(readers[i] = brume_thread_start(go_in_and_out, NULL));
    brume_sleep(0.02);
    __atomic_store_n(&wanted, 1, __ATOMIC_RELEASE);
    brume_lock_exclusive(&lock);
    __atomic_store_n(&had, 1, __ATOMIC_RELEASE);
    brume_unlock_exclusive(&lock);
    for (int i = 0; i < READERS; i++) brume_thread_join(readers[i]);
    print_message("after %d turns of others\n", turns_meanwhile);
    assert_true(turns_meanwhile < 4000);
}

/* ---- text and paths -------------------------------------------------------------------------------------------- */

static void numbers_have_a_point(void **state) {
    (void)state;
    brume_c_locale *locale = brume_c_locale_create();
    assert_non_null(locale);
    assert_true(brume_c_locale_strtod(locale, "-12.5e1,3") == -125);
    brume_c_locale_destroy(locale);
    brume_c_locale_destroy(NULL);
    assert_true(brume_same_letters(".PnG", ".png"));
    assert_false(brume_same_letters(".png", ".pn"));
    assert_false(brume_same_letters(".png", ".pnh"));
}

static void paths_are_taken_apart(void **state) {
    (void)state;
    assert_int_equal(brume_path_folder("fog.xml"), 0);
    assert_int_equal(brume_path_folder("a/b/fog.xml"), 4);
    assert_int_equal(brume_path_folder("/fog.xml"), 1);
    assert_int_equal(brume_path_folder("a/"), 2);
    assert_true(brume_path_is_absolute("/a"));
    assert_false(brume_path_is_absolute("a/b"));
    assert_false(brume_path_is_absolute(""));
#ifdef _WIN32
    assert_int_equal(brume_path_folder("a\\b/c\\fog.xml"), 6);
    assert_int_equal(brume_path_folder("c:fog.xml"), 2);
    assert_true(brume_path_is_absolute("c:\\a"));
    assert_true(brume_path_is_absolute("\\\\server\\a"));
#endif
    assert_true(brume_path_exists(folder));
    assert_true(brume_path_is_folder(folder));
    assert_false(brume_path_exists(in_folder("nothing")));
    assert_false(brume_path_is_folder(in_folder("nothing")));
}

/* ---- files ----------------------------------------------------------------------------------------------------- */

static void a_file_is_created_once(void **state) {
    (void)state;
    int file = brume_file_create(in_folder("once"), 0);
    assert_true(file >= 0);
    assert_int_equal(brume_file_write_at(file, "world", 5, 6), 0);
    assert_int_equal(brume_file_write_at(file, "hello\n", 6, 0), 0); /* and no carriage return */
    assert_int_equal(brume_file_write_at(file, "x", 1, UINT64_MAX), EFBIG);
    assert_int_equal(brume_file_close(file), 0);
    errno = 0;
    assert_true(brume_file_create(in_folder("once"), 0) < 0);
    assert_int_equal(errno, EEXIST);
    size_t size = 0;
    unsigned char *bytes = brume_file_read_used(in_folder("once"), 1, 100, &size);
    assert_non_null(bytes);
    assert_int_equal(size, 11);
    assert_memory_equal(bytes, "hello\nworld", 11);
    free(bytes);
    assert_null(brume_file_read_used(in_folder("once"), 12, 100, &size));
    assert_null(brume_file_read_used(in_folder("once"), 1, 10, &size));
    assert_null(brume_file_read_used(in_folder("nothing"), 0, 10, &size));
    assert_null(brume_file_read_used(folder, 0, 1 << 20, &size));
    assert_false(brume_path_is_folder(in_folder("once")));
    remove(in_folder("once"));
}

static void a_file_is_replaced_whole(void **state) {
    (void)state;
    char other[600];
    int before = files();
    size_t size = 0;
    assert_int_equal(brume_file_replace(in_folder("kept"), "first, and long", 15, 1), 0);
    assert_int_equal(brume_file_replace(in_folder("kept"), "second", 6, 1), 0);
    assert_int_equal(files(), before + 1); /* no temporary one is left */
    unsigned char *bytes = brume_file_read_used(in_folder("kept"), 1, 100, &size);
    assert_non_null(bytes);
    assert_int_equal(size, 6);
    assert_memory_equal(bytes, "second", 6);
    free(bytes);
    /* Renaming goes over what is there. */
    assert_int_equal(brume_file_replace(in_folder("new"), "third", 5, 1), 0);
    snprintf(other, sizeof other, "%s", in_folder("kept"));
    assert_int_equal(brume_file_rename(in_folder("new"), other), 0);
    assert_int_equal(files(), before + 1);
    assert_int_equal(brume_file_rename(in_folder("nothing"), other), ENOENT);
    brume_folder_remove(folder, "kept");
    brume_folder_remove(folder, "nothing");
    assert_int_equal(files(), before);
    assert_int_equal(brume_file_replace(in_folder("no-such-folder/file"), "x", 1, 0), ENOENT);
}

#ifndef _WIN32 /* which refuses to replace a file while it is read */
enum { WRITERS = 4, REPLACEMENTS = 50, LARGEST = 40000 };

typedef struct writer {
    const char *path;
    int number, failures, mixtures;
} writer;

/* As many bytes of the same letter as the letter says. */
static void replace_again_and_again(void *argument) {
    writer *w = argument;
    size_t size = (size_t)LARGEST / (size_t)(w->number + 1), got;
    char *bytes = malloc(size);
    if (bytes) memset(bytes, 'a' + w->number, size);
    for (int i = 0; i < REPLACEMENTS && bytes; i++) {
        w->failures += brume_file_replace(w->path, bytes, size, 0) != 0;
        unsigned char *read = brume_file_read_used(w->path, 1, LARGEST, &got);
        size_t first = read ? (size_t)(read[0] - 'a') : WRITERS;
        int whole = first < WRITERS && got == LARGEST / (first + 1);
        for (size_t k = 0; whole && k < got; k++) whole = read[k] == read[0];
        w->mixtures += !whole;
        free(read);
    }
    w->failures += !bytes;
    free(bytes);
}

/* Whoever reads gets one writer's file, and no writer takes another's away. */
static void writers_do_not_meet(void **state) {
    (void)state;
    char shared[600];
    brume_thread *threads[WRITERS];
    writer writers[WRITERS];
    int before = files();
    snprintf(shared, sizeof shared, "%s", in_folder("shared"));
    for (int i = 0; i < WRITERS; i++) {
        writers[i] = (writer){shared, i, 0, 0};
        threads[i] = brume_thread_start(replace_again_and_again, &writers[i]);
        assert_non_null(threads[i]);
    }
    for (int i = 0; i < WRITERS; i++) brume_thread_join(threads[i]);
    for (int i = 0; i < WRITERS; i++) {
        assert_int_equal(writers[i].failures, 0);
        assert_int_equal(writers[i].mixtures, 0);
    }
    assert_int_equal(files(), before + 1);
    brume_folder_remove(folder, "shared");
}
#endif

static int look(void *user, const brume_folder_entry *entry) {
    brume_folder_entry *seen = user;
    if (strcmp(entry->name, "seen") == 0) *seen = *entry;
    return 1;
}

static int stop(void *user, const brume_folder_entry *entry) {
    (void)entry;
    ++*(int *)user;
    return 0;
}

static void folders_tell_sizes_and_ages(void **state) {
    (void)state;
    brume_folder_entry seen = {NULL, 0, -100};
    assert_int_equal(brume_file_replace(in_folder("seen"), "12345", 5, 1), 0);
    assert_int_equal(brume_file_replace(in_folder("other"), "1", 1, 1), 0);
    brume_folder_visit(folder, look, &seen);
    assert_int_equal(seen.size, 5);
    assert_true(seen.age > -3 && seen.age < 60); /* file systems count in seconds, some in two */
    int visits = 0;
    brume_folder_visit(folder, stop, &visits);
    assert_int_equal(visits, 1);
    brume_folder_visit(in_folder("no-such-folder"), stop, &visits);
    assert_int_equal(visits, 1);
}

static void the_cache_lies_where_the_system_has_it(void **state) {
    (void)state;
    char *cache = brume_path_user_cache();
    if (cache) assert_true(brume_path_is_absolute(cache));
    free(cache);
}

/* Longer than a long can tell on some systems; nothing is in it but its last byte. */
static void a_file_may_be_long(void **state) {
    (void)state;
    const uint64_t end = (uint64_t)3 << 30;
    uint64_t length = 0;
    int descriptor = brume_file_create(in_folder("long"), 0);
    assert_true(descriptor >= 0);
    assert_int_equal(brume_file_write_at(descriptor, "a", 1, end - 1), 0);
    assert_int_equal(brume_file_close(descriptor), 0);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(brume_file_length(file, &length), 0);
    assert_true(length == end && ftell(file) == 0);
    fclose(file);
    assert_int_equal(remove(path), 0);
}

static void this_process_and_host(void **state) {
    (void)state;
    char name[256] = "", cut[3] = "ab";
    assert_false(brume_process_is_gone(brume_process_number()));
    assert_true(brume_process_is_gone(999999996)); /* more than systems count to, and a multiple of 4 as Windows' are */
    brume_host_name(name, sizeof name);
    assert_true(memchr(name, 0, sizeof name) != NULL);
    brume_host_name(cut, sizeof cut);
    assert_non_null(memchr(cut, 0, sizeof cut));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(time_goes_on),
        cmocka_unit_test(an_exclusive_lock_excludes),
        cmocka_unit_test(a_shared_lock_is_shared),
        cmocka_unit_test(who_wants_it_alone_gets_it),
        cmocka_unit_test(numbers_have_a_point),
        cmocka_unit_test(paths_are_taken_apart),
        cmocka_unit_test(a_file_is_created_once),
        cmocka_unit_test(a_file_is_replaced_whole),
        cmocka_unit_test(a_file_may_be_long),
        cmocka_unit_test(this_process_and_host),
#ifndef _WIN32
        cmocka_unit_test(writers_do_not_meet),
#endif
        cmocka_unit_test(folders_tell_sizes_and_ages),
        cmocka_unit_test(the_cache_lies_where_the_system_has_it),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
