/* cache_folder.c -- see cache_folder.h. */
#include "cache_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "sha256.h"

char cache_parent[] = "/tmp/brume-cache-XXXXXX";
char cache_folder[64];

int cache_folder_make(void) {
    if (!mkdtemp(cache_parent)) return -1;
    snprintf(cache_folder, sizeof cache_folder, "%s/a/brume", cache_parent);
    return 0;
}

int cache_folder_remove(void) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", cache_parent);
    return system(command);
}

void cache_folder_clear(void) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", cache_folder);
    assert_int_equal(system(command), 0);
}

int cache_folder_entries(void) {
    char command[128], answer[16] = "";
    snprintf(command, sizeof command, "ls -A '%s' | wc -l", cache_folder);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    assert_non_null(fgets(answer, sizeof answer, pipe));
    pclose(pipe);
    return atoi(answer);
}

void entry_seal(unsigned char *entry, size_t size) {
    brume_sha256(entry, size - SHA256_SIZE, entry + size - SHA256_SIZE);
}
