/* clEnqueueFillBuffer as a write, for a program inside Oclgrind: 21.10 takes memory that was filled for memory that was
 * never set. Preloaded before Oclgrind's own library. */
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <stdlib.h>
#include <string.h>

CL_API_ENTRY cl_int CL_API_CALL clEnqueueFillBuffer(cl_command_queue queue, cl_mem buffer, const void *pattern,
                                                    size_t pattern_size, size_t offset, size_t size, cl_uint waits,
                                                    const cl_event *wait_list, cl_event *event) {
    char *data = malloc(size + 1);
    if (!data) return CL_OUT_OF_HOST_MEMORY;
    for (size_t i = 0; i < size; i += pattern_size) memcpy(data + i, pattern, pattern_size);
    cl_int code = clEnqueueWriteBuffer(queue, buffer, CL_TRUE, offset, size, data, waits, wait_list, event);
    free(data);
    return code;
}
