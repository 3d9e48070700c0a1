/* sha256.h -- SHA-256 (FIPS 180-4): names and guards the entries of the program cache. */
#ifndef BRUME_SHA256_H
#define BRUME_SHA256_H

#include <stddef.h>
#include <stdint.h>

enum { SHA256_SIZE = 32 };

void brume_sha256(const void *data, size_t size, uint8_t out[SHA256_SIZE]);

#endif
