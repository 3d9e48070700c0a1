/* clEnqueueNDRangeKernel fails from the call on that the environment counts to (FAIL_LAUNCHES_FROM), as of a device
 * that falls over in the middle of a render. Preloaded into render-cli by a test. */
#define _GNU_SOURCE
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <dlfcn.h>
#include <stdlib.h>

CL_API_ENTRY cl_int CL_API_CALL clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                                                       const size_t *offset, const size_t *global, const size_t *local,
                                                       cl_uint waits, const cl_event *wait_list, cl_event *event) {
    static int calls;
    const char *from = getenv("FAIL_LAUNCHES_FROM");
    if (from && ++calls >= atoi(from)) return CL_INVALID_COMMAND_QUEUE;
    cl_int(CL_API_CALL *call)(cl_command_queue, cl_kernel, cl_uint, const size_t *, const size_t *, const size_t *,
                              cl_uint, const cl_event *, cl_event *);
    *(void **)&call = dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel");
    return call(queue, kernel, dimensions, offset, global, local, waits, wait_list, event);
}
