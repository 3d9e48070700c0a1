/* targets.h -- the readers of files from anywhere, one function each that is given bytes and must come back: with a
 * result or an error, without a crash, a leak, a file written or opened for writing, or more memory than a few bytes
 * allow.
 *
 * `make fuzz` drives them by libFuzzer, test_hostile by the files that it starts from and has found (found/).
 */
#ifndef FUZZ_TARGETS_H
#define FUZZ_TARGETS_H

#include <stddef.h>
#include <stdint.h>

/* A scene of several files: scene.xml, then each behind a line "%% name" of its own, which the scene may name. */
void fuzz_scene(const uint8_t *bytes, size_t size);
void fuzz_obj(const uint8_t *bytes, size_t size);
void fuzz_ply(const uint8_t *bytes, size_t size);
/* EXR, PNG, JPEG, HDR. */
void fuzz_picture(const uint8_t *bytes, size_t size);
/* Its length and checksum are made right first, or nothing behind them would ever be read. */
void fuzz_checkpoint(const uint8_t *bytes, size_t size);

typedef struct fuzz_target {
    const char *name;
    void (*run)(const uint8_t *bytes, size_t size);
} fuzz_target;

enum { FUZZ_TARGETS = 5 };
extern const fuzz_target fuzz_targets[FUZZ_TARGETS];

/* Writes what fuzzing starts from: FOLDER/NAME/..., a few small files for each target. Returns 0 if it can't. */
int fuzz_write_seeds(const char *folder);

#endif
