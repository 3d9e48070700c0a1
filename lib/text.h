/* text.h -- a string that grows. */
#ifndef BRUME_TEXT_H
#define BRUME_TEXT_H

#include <stddef.h>
#include <stdio.h>

typedef struct brume_text {
    char *data; /* NUL-terminated, or NULL while empty; free() */
    size_t length, capacity;
    int failed; /* memory ran out, or one formatted piece was longer than 1023 bytes: data is cut short */
} brume_text;

void brume_text_add(brume_text *text, const char *bytes, size_t count);
void brume_text_format(brume_text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* For reading, what a scene names; NULL with errno set: EOPNOTSUPP for a device or a pipe, which may have no end. */
FILE *brume_file_open_named(const char *path);

/* The whole of such a file, NUL-terminated; NULL with errno set. free() */
char *brume_text_read_file(const char *path, size_t *out_size);

#endif
