/* device.h -- one opened OpenCL device: its context and its queue; or several that share renders. */
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
    int is_part;            /* the id is a sub-device's, to be released */
    brume_device **members; /* of a joined device, which has no id, context and queue of its own; else NULL */
    uint32_t member_count;  /* 0: not joined */
};

brume_device *brume_device_retain(brume_device *device);

/* The id of the device of this number; and a device made of an id, which becomes its own if it is a part's. */
brume_result brume_device_find(brume_context *context, uint32_t index, cl_device_id *out);
brume_result brume_device_open_id(brume_context *context, cl_device_id id, int is_part, brume_device **out);

/* "CL_OUT_OF_RESOURCES" and so on. */
const char *brume_cl_error_name(cl_int code);

/* BRUME_ERROR_DEVICE, or _MEMORY for an allocation failure, with "what: CL_NAME (code)". */
brume_result brume_fail_cl(brume_context *context, cl_int code, const char *what);

#endif
