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

int files_begin(files_draft *out, const char *path)
{
    files_draft draft = {NULL, path, NULL};
    if (platform_is_special(path)) {
        draft.file = fopen(path, "wb");
    } else {
        brume_file_remove_stale(path);
        int descriptor = brume_file_create_beside(path, 0, &draft.temporary); /* the name is ours */
        if (descriptor < 0)
            return errno;
        brume_file_close(descriptor);
        draft.file = fopen(draft.temporary, "wb");
    }
    if (draft.file) {
        *out = draft;
        return 0;
    }
    int error = errno;
    if (draft.temporary)
        remove(draft.temporary);
    free(draft.temporary);
    return error;
}

int files_end(files_draft *draft, int keep)
{
    int error = ferror(draft->file) ? errno ? errno : EIO : 0;
    if (!error)
        error = draft->temporary ? platform_sync(draft->file) : fflush(draft->file) != 0 ? errno : 0;
    if (fclose(draft->file) != 0 && !error)
        error = errno;
    if (draft->temporary) {
        if (!error && keep)
            error = brume_file_rename(draft->temporary, draft->path);
        if (error || !keep)
            remove(draft->temporary);
    }
    free(draft->temporary);
    return error;
}

int files_write(const char *path, const void *bytes, size_t size)
{
    return brume_file_replace(path, bytes, size, 0);
}
