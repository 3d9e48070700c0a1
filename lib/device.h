/* device.h -- one opened OpenCL device: its context and its queue. */
#ifndef BRUME_DEVICE_H
#define BRUME_DEVICE_H

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include "context.h"

struct brume_device {
    int references;
    brume_context *context; /* retained */
    brume_device_info info;
    uint64_t largest_buffer; /* bytes */
    cl_device_id id;
    cl_context cl;
    cl_command_queue queue; /* in order */
};

brume_device *brume_device_retain(brume_device *device);

/* "CL_OUT_OF_RESOURCES" and so on. */
const char *brume_cl_error_name(cl_int code);

/* BRUME_ERROR_DEVICE, or _MEMORY for an allocation failure, with "what: CL_NAME (code)". */
brume_result brume_fail_cl(brume_context *context, cl_int code, const char *what);

#endif
