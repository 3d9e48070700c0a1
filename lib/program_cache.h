/* program_cache.h -- compiled programs on disk, so that a scene that was rendered before starts at once.
 *
 * A folder of one file per program. Several processes may share it: entries appear whole, by renaming, and one that is
 * truncated, damaged or another program's is never handed to the driver. The cache may cost time, but never a picture:
 * whatever goes wrong here, the program is built from source.
 */
#ifndef BRUME_PROGRAM_CACHE_H
#define BRUME_PROGRAM_CACHE_H

#include "program.h"

/* Together the entries take no more; those used least recently go first. */
#define PROGRAM_CACHE_LIMIT ((uint64_t)256 << 20)

/* $BRUME_CACHE_DIR, where set; else $XDG_CACHE_HOME/brume, else ~/.cache/brume. malloc'ed. NULL: no cache, which is
 * also what an empty BRUME_CACHE_DIR asks for. */
char *brume_program_cache_folder(void);

/* What a binary depends on, as lines of text: version of the library, platform, device, driver, options, and the
 * SHA-256 of the source. It is repeated in the entry; its own SHA-256, cut to 128 bits, names the file. malloc'ed, NULL
 * when memory ran out. */
char *brume_program_cache_facts(brume_device *device, const brume_program_source *source);

/* malloc'ed path of the entry; NULL when memory ran out. */
char *brume_program_cache_path(const char *folder, const char *facts);

/* The binary of an entry, malloc'ed; NULL if there is none that is whole and has these facts. */
unsigned char *brume_program_cache_load(const char *folder, const char *facts, size_t *size);

/* Writes an entry, then removes old ones until all are within `limit` bytes. Returns whether it was written. */
int brume_program_cache_store(const char *folder, const char *facts, const unsigned char *binary, size_t size,
                              uint64_t limit);

/* The built program of an entry; NULL if there is none, or the driver doesn't take it. */
cl_program brume_program_cache_open(brume_device *device, const char *folder, const brume_program_source *source,
                                    uint64_t *bytes);

/* Keeps a program that was built from source and has run: PoCL's binaries hold the machine code of the launches so
 * far. Slow there, because it generates code once more, for any local size. No launch of it may be under way. Returns
 * whether it is kept. */
int brume_program_cache_keep(brume_device *device, const char *folder, const brume_program_source *source,
                              cl_program program);

#endif
