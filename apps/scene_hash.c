/* scene_hash.c -- see scene_hash.h. */
#include "scene_hash.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

enum { LONGEST = 1024, NESTING = 2 };

void scene_hash_bytes(uint64_t *hash, const void *data, size_t size)
{
    for (size_t i = 0; i < size; i++)
        *hash = (*hash ^ ((const unsigned char *)data)[i]) * UINT64_C(0x100000001b3);
}

static char *read_text(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    if (file && fseek(file, 0, SEEK_END) == 0) {
        long length = ftell(file);
        rewind(file);
        text = length >= 0 ? malloc((size_t)length + 1) : NULL;
        if (text && fread(text, 1, (size_t)length, file) == (size_t)length) {
            text[length] = 0;
            *size = (size_t)length;
        } else {
            free(text);
            text = NULL;
        }
    }
    if (file)
        fclose(file);
    return text;
}

static void hash_file(uint64_t *hash, const char *path, int nesting)
{
    size_t size = 0, length = strlen(path);
    char *text = read_text(path, &size);
    if (!text)
        return;
    scene_hash_bytes(hash, text, size);
    int is_scene = length > 4 && strcmp(path + length - 4, ".xml") == 0;
    /* Every quote may begin a name: in a comment or a text an apostrophe may stand alone. */
    for (const char *begin = strpbrk(text, "\"'"); begin && is_scene && nesting > 0; begin = strpbrk(begin, "\"'")) {
        const char quote[2] = {*begin, 0};
        size_t quoted = strcspn(++begin, quote);
        size_t folder = brume_path_is_absolute(begin) ? 0 : brume_path_folder(path);
        char name[2 * LONGEST];
        if (quoted > 4 && quoted < LONGEST && begin[quoted - 4] == '.' && folder < LONGEST) {
            memcpy(name, path, folder);
            memcpy(name + folder, begin, quoted);
            name[folder + quoted] = 0;
            hash_file(hash, name, nesting - 1);
        }
    }
    free(text);
}

void scene_hash_file(uint64_t *hash, const char *path)
{
    hash_file(hash, path, NESTING);
}
