/* guard.h -- between guard_begin and guard_end the process ends by abort() when it opens a file for writing, renames or
 * removes one, or makes a folder: reading a scene changes nothing anywhere. */
#ifndef FUZZ_GUARD_H
#define FUZZ_GUARD_H

void guard_begin(void);
void guard_end(void);

#endif
