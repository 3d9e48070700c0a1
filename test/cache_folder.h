/* cache_folder.h -- a folder for the cache of compiled programs, made and removed with the test program. */
#ifndef TEST_CACHE_FOLDER_H
#define TEST_CACHE_FOLDER_H

#include <stddef.h>

enum { ENTRY_HEADER = 24 }; /* bytes before an entry's facts: program_cache.c describes the format */

/* The temporary folder, and the one in it that the cache has to make. */
extern char cache_parent[], cache_folder[64];

int cache_folder_make(void);   /* 0, or -1 */
int cache_folder_remove(void); /* 0, or another number */
void cache_folder_clear(void); /* the cache has to make it again */
int cache_folder_entries(void);

/* Gives an entry that was changed the digest that belongs to it. */
void entry_seal(unsigned char *entry, size_t size);

#endif
