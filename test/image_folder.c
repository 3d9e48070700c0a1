/* image_folder.c -- the folder of tests of pictures. */
#include "image_folder.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

char path_memory[512];
static char folder[] = "/tmp/brume-image-XXXXXX";

const char *in_folder(const char *name) {
    snprintf(path_memory, sizeof path_memory, "%s/%s", folder, name);
    return path_memory;
}

int files_in_folder(void) {
    DIR *dir = opendir(folder);
    int count = 0;
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));)
        count += entry->d_name[0] != '.';
    closedir(dir);
    return count;
}

static void empty_folder(void) {
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));)
        if (entry->d_name[0] != '.')
            remove(in_folder(entry->d_name));
    closedir(dir);
}

int open_images(void **state) {
    (void)state;
    return brume_context_create(&context) != BRUME_OK || !mkdtemp(folder);
}

int close_images(void **state) {
    (void)state;
    empty_folder();
    rmdir(folder);
    brume_context_destroy(context);
    return 0;
}

int fresh_folder(void **state) {
    (void)state;
    empty_folder();
    return 0;
}

void put_file(const char *name, const void *bytes, size_t size) {
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}
