/* cl_shim.h -- OpenCL that fails when told to: the entry points of libOpenCL that brume calls, defined in the test
 * program itself, so that the linker finds these first. Each passes its call on unless it is to fail.
 *
 * Calls are counted from cl_shim_reset() on, by function and by whether the test's thread made them (the quick start
 * builds in a thread of its own): a fault is "the n-th clSetKernelArg of the main thread".
 */
#ifndef CL_SHIM_H
#define CL_SHIM_H

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

typedef enum cl_function {
    CL_GET_PLATFORM_IDS, CL_GET_PLATFORM_INFO, CL_GET_DEVICE_IDS, CL_GET_DEVICE_INFO, CL_CREATE_CONTEXT,
    CL_CREATE_COMMAND_QUEUE, CL_CREATE_BUFFER, CL_GET_MEM_OBJECT_INFO, CL_CREATE_PROGRAM_WITH_SOURCE,
    CL_CREATE_PROGRAM_WITH_BINARY, CL_BUILD_PROGRAM, CL_GET_PROGRAM_INFO, CL_GET_PROGRAM_BUILD_INFO, CL_CREATE_KERNEL, CL_CREATE_KERNELS_IN_PROGRAM,
    CL_SET_KERNEL_ARG, CL_ENQUEUE_FILL_BUFFER, CL_ENQUEUE_READ_BUFFER, CL_ENQUEUE_WRITE_BUFFER,
    CL_ENQUEUE_ND_RANGE_KERNEL, CL_FINISH, CL_RELEASE_MEM_OBJECT, CL_RELEASE_KERNEL, CL_RELEASE_PROGRAM,
    CL_RELEASE_COMMAND_QUEUE, CL_RELEASE_CONTEXT, CL_ENQUEUE_READ_BUFFER_RECT, CL_ENQUEUE_WRITE_BUFFER_RECT,
    CL_CREATE_SUB_DEVICES, CL_RELEASE_DEVICE,
    CL_FUNCTION_COUNT
} cl_function;

/* "clGetPlatformIDs" and so on. */
const char *cl_shim_name(cl_function function);

/* The errors that the specification, or a driver in want of memory, lets the function return; 0 at the end. */
const cl_int *cl_shim_errors(cl_function function);
/* "CL_OUT_OF_RESOURCES" and so on. */
const char *cl_shim_error_name(cl_int code);

typedef enum cl_manner {
    CL_FAILS,     /* nothing is done */
    CL_DONE,      /* clFinish: it waits, and then fails all the same */
    CL_HALF,      /* clEnqueueNDRangeKernel: the first half of the work-items run, and the call fails */
    CL_LOST,      /* this call and every later one fails, of whatever function, as when a device is gone; what releases
                     objects still releases them */
    CL_FULL       /* this call and every later one of the function fails */
} cl_manner;

typedef struct cl_fault {
    cl_function function;
    int in_thread;   /* of a call that another thread than the test's makes */
    unsigned n;      /* which call, from 1 on */
    cl_int code;
    cl_manner manner;
} cl_fault;

/* Calls are counted from 0 on again, and none is to fail. The caller's thread is the main one from now on. */
void cl_shim_reset(void);
void cl_shim_arm(const cl_fault *fault);
/* Nothing fails any more; counts go on. Returns whether something has. */
int cl_shim_disarm(void);
/* Whether something has failed since it was armed. */
int cl_shim_fired(void);
unsigned cl_shim_calls(cl_function function, int in_thread);

/* Objects created and not yet released, over all functions. */
int cl_shim_outstanding(void);

/* What CL_DEVICE_GLOBAL_MEM_SIZE and CL_DEVICE_MAX_MEM_ALLOC_SIZE are said to be; 0: what they are. */
void cl_shim_set_memory(cl_ulong all, cl_ulong at_once);

/* A made-up device's speed: from now on the main thread's monotonic clock stands still but for launches, each of which
 * takes so many seconds for a sample of a work-item; 0: time as it is. */
void cl_shim_set_speed(double seconds_per_sample);
/* The longest launch since then, in these seconds, and how many there were. */
double cl_shim_longest_launch(void);
/* Launches on this queue, the first or the second of two, take so many seconds more for a sample of a work-item; NULL
 * and 0: they don't. */
void cl_shim_set_drag(int which, cl_command_queue queue, double seconds_per_sample);
/* Launches that need more work-items than this fail with CL_OUT_OF_RESOURCES; 0: none. */
void cl_shim_set_most_items(size_t items);
/* Whether the thread is in a call of libOpenCL's: what it allocates there is the driver's. */
int cl_shim_inside(void);

#endif
