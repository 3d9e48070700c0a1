/* files.h -- folders and files that appear whole. */
#ifndef FILES_H
#define FILES_H

#include <stdio.h>

/* Makes the folder and those above it. 0, or errno. */
int files_make_folder(const char *path);

/* Writes `size` bytes to a temporary name beside `path`, to the disk itself, and only then gives it its name: what is
 * found there is whole, whenever the program or the machine stops. 0, or errno. */
int files_write(const char *path, const void *bytes, size_t size);

#endif
