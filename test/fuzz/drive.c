/* drive.c -- libFuzzer's entry to the target that -DTARGET=NAME names; FUZZ_SEEDS=FOLDER in the environment writes the
 * files to start from instead. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "targets.h"

#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)

int LLVMFuzzerInitialize(int *count, char ***words);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerInitialize(int *count, char ***words) {
    (void)count;
    (void)words;
    const char *folder = getenv("FUZZ_SEEDS");
    if (!folder) return 0;
    if (!fuzz_write_seeds(folder)) fprintf(stderr, "%s: can't be written to\n", folder);
    exit(!fuzz_write_seeds(folder));
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
    PASTE(fuzz_, TARGET)(bytes, size);
    return 0;
}
