/* files.c -- see files.h. */
#include "files.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

int files_make_folder(const char *path)
{
    size_t length = strlen(path);
    char *part = malloc(length + 1);
    int error = part ? 0 : ENOMEM;
    if (part)
        memcpy(part, path, length + 1);
    for (size_t i = 1; i <= length && !error; i++)
        if (part[i] == '/' || part[i] == 0) {
            char kept = part[i];
            part[i] = 0;
            error = platform_make_folder(part);
            if (error == EEXIST)
                error = 0;
            part[i] = kept;
        }
    free(part);
    return error;
}

int files_write(const char *path, const void *bytes, size_t size)
{
    return brume_file_replace(path, bytes, size, 0);
}
