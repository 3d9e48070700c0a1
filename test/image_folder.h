/* image_folder.h -- a temporary folder for pictures, for tests of lib/image_*.c. */
#ifndef TEST_IMAGE_FOLDER_H
#define TEST_IMAGE_FOLDER_H

#include <stddef.h>

#include "image.h"
#include "open_device.h" /* the context */

extern char path_memory[512]; /* the path that in_folder made last */

/* The path of a file in the folder, valid until the next call. */
const char *in_folder(const char *name);

/* How many there are, but for hidden ones. */
int files_in_folder(void);

/* Writes a file. */
void put_file(const char *name, const void *bytes, size_t size);

/* Of groups: the context and the folder. */
int open_images(void **state);
int close_images(void **state);

/* A test that finds the folder empty. */
#define FRESH(test) cmocka_unit_test_setup(test, fresh_folder)
int fresh_folder(void **state);

#endif
