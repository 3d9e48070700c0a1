/* text.c -- see text.h. */
#include "text.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

void brume_text_add(brume_text *text, const char *bytes, size_t count) {
    if (text->failed) return;
    if (text->length + count + 1 > text->capacity) {
        size_t capacity = (text->length + count + 1) * 2;
        char *data = realloc(text->data, capacity);
        if (!data) {
            text->failed = 1;
            return;
        }
        text->data = data;
        text->capacity = capacity;
    }
    memcpy(text->data + text->length, bytes, count);
    text->length += count;
    text->data[text->length] = 0;
}

void brume_text_format(brume_text *text, const char *format, ...) {
    char line[1024];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (length < 0 || (size_t)length >= sizeof line)
        text->failed = 1;
    else
        brume_text_add(text, line, (size_t)length);
}

FILE *brume_file_open_named(const char *path) {
    if (!brume_path_is_endless(path)) return fopen(path, "rb");
    errno = EOPNOTSUPP;
    return NULL;
}

char *brume_text_read_file(const char *path, size_t *out_size) {
    FILE *file = brume_file_open_named(path);
    if (!file) return NULL;
    brume_text text = {0};
    brume_text_add(&text, "", 0);
    char block[65536];
    size_t got;
    while ((got = fread(block, 1, sizeof block, file)) > 0) brume_text_add(&text, block, got);
    int error = ferror(file) ? (errno ? errno : EIO) : text.failed ? ENOMEM : 0;
    fclose(file);
    if (error) {
        free(text.data);
        errno = error;
        return NULL;
    }
    if (out_size) *out_size = text.length;
    return text.data;
}
