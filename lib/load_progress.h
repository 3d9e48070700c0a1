/* load_progress.h -- how far a long file has been read, for whoever waits for it. */
#ifndef BRUME_LOAD_PROGRESS_H
#define BRUME_LOAD_PROGRESS_H

#include "context.h"

/* Before a file is read. */
void brume_load_begin(brume_context *context);

/* Now and then while it is: tells the callback, a few times a second. 0: it wants no more of it. */
int brume_load_goes_on(brume_context *context, const char *path, double fraction);

#endif
