/* open_device.h -- the context and the device that all tests of a program share. */
#ifndef OPEN_DEVICE_H
#define OPEN_DEVICE_H

#include "device.h"

/* Set by open_device and freed by close_device, a test program's group setup and teardown, which also removes a planted
 * bug (planted.h); device is NULL where there is none. */
extern brume_context *context;
extern brume_device *device;
int open_device(void **state);
int close_device(void **state);
int open_context(void **state); /* for tests that need no device; with close_device, too */
#define NEEDS_DEVICE() do { if (device == NULL) skip(); } while (0)

/* A buffer on the device with these bytes, or with any if there are none. */
cl_mem upload_bytes(const void *data, size_t size);

/* Fails the test with the library's message. */
void must(brume_result result);

#endif
