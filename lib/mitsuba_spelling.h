/* mitsuba_spelling.h -- "did you mean": the near spelling in error messages. */
#ifndef BRUME_MITSUBA_SPELLING_H
#define BRUME_MITSUBA_SPELLING_H

#include <stddef.h>

/* The candidate nearest to `word` if it is a likely slip of the pen, else NULL. */
const char *mitsuba_nearest(const char *word, const char *const *candidates, size_t count);

#endif
