/* files.h -- folders and files that appear whole. */
#ifndef FILES_H
#define FILES_H

#include <stdio.h>

/* Makes the folder and those above it. 0, or errno. */
int files_make_folder(const char *path);

/* A file that appears whole: what goes to `file` lies under a temporary name beside `path` until files_end gives it its
 * own. Where `path` is there and is no regular file, a device or a pipe, it is that which is written to. */
typedef struct files_draft {
    FILE *file;
    const char *path; /* the caller's, valid until the end */
    char *temporary;  /* NULL: none */
} files_draft;

/* 0, or errno: then there is nothing to end. */
int files_begin(files_draft *out, const char *path);
/* With `keep`, and if every write succeeded, the file gets its name once the disk has it; else what was there stays.
 * Releases everything. 0, or errno: EIO where a write failed and the reason is no longer known. */
int files_end(files_draft *draft, int keep);

/* Writes `size` bytes to a temporary name beside `path`, to the disk itself, and only then gives it its name: what is
 * found there is whole, whenever the program or the machine stops. 0, or errno. */
int files_write(const char *path, const void *bytes, size_t size);

#endif
