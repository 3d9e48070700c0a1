/* session.h -- everything that a program does with brume, once, while an OpenCL call is to fail: whatever fails is
 * asked for again, and in the end there must be the picture that there is without the fault, to the bit.
 */
#ifndef SESSION_H
#define SESSION_H

#include "cl_shim.h"

typedef enum session_kind {
    SESSION_CACHED,   /* the program comes from the cache */
    SESSION_ADAPTIVE, /* so does it, and samples go where the error is, until it is low enough */
    SESSION_SAVED,    /* the same, broken off in the middle of a pass, and gone on with in another render, from a file */
    SESSION_SOURCE,   /* it is built from source, and put into the cache */
    SESSION_QUICK,    /* a thread builds it, while a narrow one renders */
    SESSION_KINDS
} session_kind;

extern const char *const session_names[SESSION_KINDS];

/* A temporary folder, the scene; and the pictures, and how many calls there are of each function, without faults.
 * Returns 0 if there is no device, < 0 if they don't come out right, with the reason on standard error. */
int sessions_begin(void);
void sessions_end(void);

/* Of the session without faults. */
unsigned session_calls(session_kind kind, cl_function function, int in_thread);

typedef enum session_end {
    SESSION_UNTOUCHED, /* the call never came */
    SESSION_WENT_ON,   /* nobody noticed: the picture is the same */
    SESSION_REPORTED,  /* by an error of the right kind that names OpenCL's; asked again, all went well */
    SESSION_LOST       /* something was: `loss` says what */
} session_end;

/* `loss` gets a line. With CL_LOST the device is gone until everything has been destroyed, and then comes back. */
session_end session_with(session_kind kind, const cl_fault *fault, char loss[256]);

/* "cached: the 3rd clFinish of the main thread, CL_OUT_OF_RESOURCES" */
void session_describe(session_kind kind, const cl_fault *fault, char *out, size_t size);

#endif
