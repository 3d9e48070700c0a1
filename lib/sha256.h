/* sha256.h -- SHA-256 (FIPS 180-4): names and guards the entries of the program cache, and checkpoints. */
#ifndef BRUME_SHA256_H
#define BRUME_SHA256_H

#include <stddef.h>
#include <stdint.h>

enum { SHA256_SIZE = 32 };

/* Piece by piece: start, add as often as there is something, end. */
typedef struct brume_sha256_state {
    uint32_t h[8];
    uint8_t block[64]; /* what has not filled a block yet */
    uint64_t size;     /* bytes added */
} brume_sha256_state;

void brume_sha256_start(brume_sha256_state *state);
void brume_sha256_add(brume_sha256_state *state, const void *data, size_t size);
void brume_sha256_end(const brume_sha256_state *state, uint8_t out[SHA256_SIZE]);

/* At once. */
void brume_sha256(const void *data, size_t size, uint8_t out[SHA256_SIZE]);

#endif
