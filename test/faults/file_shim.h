/* file_shim.h -- a disk that fails when told to: the calls by which brume writes files, defined in the test program
 * itself, so that the linker takes these before the C library's. Only the calls of the thread that began count.
 */
#ifndef FILE_SHIM_H
#define FILE_SHIM_H

typedef enum file_fault {
    FILE_NONE,
    FILE_FAILS, /* the call reports an error; a write has written half by then */
    FILE_FULL,  /* so does every later one that would make a file larger: open, write, fsync */
    FILE_ENDS,  /* from the call on nothing happens any more, as when the process had ended */
    FILE_KILLS  /* and it does end */
} file_fault;

/* Counts calls from 0 on, and has the one at `at` meet the fault, with `error` as errno. */
void file_shim_begin(file_fault fault, int at, int error);
void file_shim_end(void);

int file_shim_calls(void);
/* The calls: o, w, f, c, r, O, F, C: open, write, fsync, close, rename; capital: of the folder. The first 1023. */
const char *file_shim_log(void);

#endif
