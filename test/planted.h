/* planted.h -- kernels with an error in them, for tests that must notice it. */
#ifndef PLANTED_H
#define PLANTED_H

/* From now on kernels are built from a copy of cl/ in which `right`, found in `file` exactly once, reads `wrong`. Fails
 * the test if it isn't. */
void planted_bug(const char *file, const char *right, const char *wrong);

/* From now on they are the library's own again. Does nothing where no bug is planted, so that it can be a teardown. */
void planted_remove(void);

#endif
