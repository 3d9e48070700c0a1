/* files.h -- what the library writes, while one of the calls that write it fails. */
#ifndef FILES_H
#define FILES_H

typedef enum files_work { FILES_EXR, FILES_PNG, FILES_CHECKPOINT, FILES_MERGED_EXR, FILES_MERGED_PNG, FILES_WORKS } files_work;

extern const char *const files_names[FILES_WORKS];

typedef struct files_sweep {
    unsigned tried, reported, went_on, lost;
} files_sweep;

/* A render, two of its parts, and a temporary folder. Returns 0 without a device, < 0 if the work fails by itself, with
 * the reason on standard error. */
int files_begin_works(void);
void files_end_works(void);

/* Every call that the work makes fails, once and with all later ones, with each of a few errors. What was there before
 * must stay whole or be replaced by the whole, the error be told by its name, nothing be left beside it; asked again,
 * the work must succeed. What doesn't hold is printed. */
void files_sweep_all(files_work work, files_sweep *s);

#endif
