/* scene_hash.h -- a number that changes when a scene does: what results that are kept on disk are known by. */
#ifndef SCENE_HASH_H
#define SCENE_HASH_H

#include <stddef.h>
#include <stdint.h>

/* FNV-1a (Fowler, Noll & Vo 1991), begun with this. */
#define SCENE_HASH_START UINT64_C(0xcbf29ce484222325)

void scene_hash_bytes(uint64_t *hash, const void *data, size_t size);

/* The file, and if it is a scene what it names in quotes that is a file, too: meshes, pictures, included scenes and
 * what those name. A file that isn't there changes nothing. */
void scene_hash_file(uint64_t *hash, const char *path);

#endif
