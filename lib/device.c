/* device.c -- finding and opening OpenCL devices. */
#include "device.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_PLATFORMS = 32, MAX_DEVICES = 64 };

const char *brume_cl_error_name(cl_int code) {
#define NAME(x) case x: return #x
    switch (code) {
    NAME(CL_DEVICE_NOT_FOUND); NAME(CL_DEVICE_NOT_AVAILABLE); NAME(CL_COMPILER_NOT_AVAILABLE);
    NAME(CL_MEM_OBJECT_ALLOCATION_FAILURE); NAME(CL_OUT_OF_RESOURCES); NAME(CL_OUT_OF_HOST_MEMORY);
    NAME(CL_BUILD_PROGRAM_FAILURE); NAME(CL_MAP_FAILURE); NAME(CL_COMPILE_PROGRAM_FAILURE);
    NAME(CL_LINKER_NOT_AVAILABLE); NAME(CL_LINK_PROGRAM_FAILURE); NAME(CL_INVALID_VALUE);
    NAME(CL_INVALID_PLATFORM); NAME(CL_INVALID_DEVICE); NAME(CL_INVALID_CONTEXT); NAME(CL_INVALID_COMMAND_QUEUE);
    NAME(CL_INVALID_MEM_OBJECT); NAME(CL_INVALID_BINARY); NAME(CL_INVALID_BUILD_OPTIONS); NAME(CL_INVALID_PROGRAM);
    NAME(CL_INVALID_PROGRAM_EXECUTABLE); NAME(CL_INVALID_KERNEL_NAME); NAME(CL_INVALID_KERNEL_DEFINITION);
    NAME(CL_INVALID_KERNEL); NAME(CL_INVALID_ARG_INDEX); NAME(CL_INVALID_ARG_VALUE); NAME(CL_INVALID_ARG_SIZE);
    NAME(CL_INVALID_KERNEL_ARGS); NAME(CL_INVALID_WORK_DIMENSION); NAME(CL_INVALID_WORK_GROUP_SIZE);
    NAME(CL_INVALID_WORK_ITEM_SIZE); NAME(CL_INVALID_GLOBAL_OFFSET); NAME(CL_INVALID_EVENT_WAIT_LIST);
    NAME(CL_INVALID_OPERATION); NAME(CL_INVALID_BUFFER_SIZE); NAME(CL_INVALID_GLOBAL_WORK_SIZE);
    case -1001: return "CL_PLATFORM_NOT_FOUND_KHR";
    }
#undef NAME
    return "unknown OpenCL error";
}

brume_result brume_fail_cl(brume_context *context, cl_int code, const char *what) {
    /* No buffer of ours is empty: one of an invalid size is larger than the device allows. */
    int memory = code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_HOST_MEMORY ||
                 code == CL_INVALID_BUFFER_SIZE;
    return brume_fail(context, memory ? BRUME_ERROR_MEMORY : BRUME_ERROR_DEVICE, "%s: %s (%d)", what,
                      brume_cl_error_name(code), (int)code);
}

/* Every device of every platform, in the order in which the drivers list them. A driver that fails is passed over, and
 * said so; *code is the last of these errors. */
static uint32_t list_devices(brume_context *context, cl_device_id devices[MAX_DEVICES], cl_int *code) {
    cl_platform_id platforms[MAX_PLATFORMS];
    cl_uint platform_count = 0, count = 0;
    *code = clGetPlatformIDs(MAX_PLATFORMS, platforms, &platform_count);
    if (*code != CL_SUCCESS) return 0;
    if (platform_count > MAX_PLATFORMS) platform_count = MAX_PLATFORMS;
    for (cl_uint p = 0; p < platform_count && count < MAX_DEVICES; p++) {
        cl_uint found = 0;
        cl_int failed = clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, MAX_DEVICES - count, devices + count, &found);
        if (failed != CL_SUCCESS) {
            *code = failed;
            if (failed != CL_DEVICE_NOT_FOUND)
                brume_warn(context, "OpenCL platform %u does not list its devices: %s (%d)", (unsigned)p,
                           brume_cl_error_name(failed), (int)failed);
            continue;
        }
        count += found < MAX_DEVICES - count ? found : MAX_DEVICES - count;
    }
    return count;
}

/* That there is none is no error of a driver's. */
static int is_absence(cl_int code) { return code == CL_SUCCESS || code == CL_DEVICE_NOT_FOUND || code == -1001; }

/* Facts asked of a device: after the first that it fails to tell the rest are not asked for. */
typedef struct inquiry { cl_device_id id; cl_int code; } inquiry;

static void ask(inquiry *q, cl_device_info what, size_t size, void *out) {
    if (q->code == CL_SUCCESS) q->code = clGetDeviceInfo(q->id, what, size, out, NULL);
}

/* malloc'ed; NULL after a failure. */
static char *ask_text(inquiry *q, cl_device_info what) {
    size_t size = 0;
    if (q->code == CL_SUCCESS) q->code = clGetDeviceInfo(q->id, what, 0, NULL, &size);
    if (q->code != CL_SUCCESS) return NULL;
    char *text = malloc(size + 1);
    if (!text) {
        q->code = CL_OUT_OF_HOST_MEMORY;
        return NULL;
    }
    q->code = size ? clGetDeviceInfo(q->id, what, size, text, NULL) : CL_SUCCESS;
    text[size] = 0;
    if (q->code == CL_SUCCESS) return text;
    free(text);
    return NULL;
}

static void ask_string(inquiry *q, cl_device_info what, char *out, size_t size) {
    char *text = ask_text(q, what);
    size_t length = text ? strlen(text) : 0;
    if (length >= size) length = size - 1;
    if (text) memcpy(out, text, length);
    out[length] = 0;
    free(text);
}

static uint32_t ask_extension(inquiry *q, const char *name) {
    char *text = ask_text(q, CL_DEVICE_EXTENSIONS);
    uint32_t found = text && strstr(text, name) != NULL;
    free(text);
    return found;
}

static void ask_platform(inquiry *q, char *out, size_t size) {
    cl_platform_id platform = NULL;
    ask(q, CL_DEVICE_PLATFORM, sizeof platform, &platform);
    if (q->code == CL_SUCCESS) q->code = clGetPlatformInfo(platform, CL_PLATFORM_NAME, size - 1, out, NULL);
}

static brume_result describe(brume_context *context, cl_device_id id, brume_device_info *out) {
    inquiry q = {id, CL_SUCCESS};
    brume_device_info info;
    memset(&info, 0, sizeof info);
    ask_string(&q, CL_DEVICE_NAME, info.name, sizeof info.name);
    ask_string(&q, CL_DRIVER_VERSION, info.driver, sizeof info.driver);
    ask_platform(&q, info.platform, sizeof info.platform);
    cl_device_type type = 0;
    cl_ulong memory = 0;
    cl_uint units = 0, width = 0;
    ask(&q, CL_DEVICE_TYPE, sizeof type, &type);
    ask(&q, CL_DEVICE_GLOBAL_MEM_SIZE, sizeof memory, &memory);
    ask(&q, CL_DEVICE_MAX_COMPUTE_UNITS, sizeof units, &units);
    ask(&q, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, sizeof width, &width);
    info.is_gpu = (type & CL_DEVICE_TYPE_GPU) != 0;
    info.compute_units = units > 0 ? units : 1;
    info.memory_bytes = memory;
    info.has_double = ask_extension(&q, "cl_khr_fp64");
    info.lanes = info.is_gpu ? 1 : width >= 16 ? 16 : 8;
    if (q.code != CL_SUCCESS) return brume_fail_cl(context, q.code, "asking the device what it is");
    *out = info;
    return BRUME_OK;
}

brume_result brume_device_count(brume_context *context, uint32_t *out) {
    if (!context || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_count: NULL argument");
    cl_device_id devices[MAX_DEVICES];
    cl_int code;
    uint32_t count = list_devices(context, devices, &code);
    if (count == 0 && !is_absence(code)) return brume_fail_cl(context, code, "listing OpenCL devices");
    *out = count;
    return BRUME_OK;
}

/* What BRUME_DEVICE_ANY takes first: a GPU, PoCL, another CPU, the rest. */
static int preference(cl_device_id id) {
    inquiry q = {id, CL_SUCCESS};
    cl_device_type type = 0;
    char name[128] = "";
    ask(&q, CL_DEVICE_TYPE, sizeof type, &type);
    ask_platform(&q, name, sizeof name);
    if (q.code != CL_SUCCESS) return 0;
    if (type & CL_DEVICE_TYPE_GPU) return 3;
    if (!(type & CL_DEVICE_TYPE_CPU)) return 0;
    return strcmp(name, "Portable Computing Language") == 0 ? 2 : 1;
}

brume_result brume_device_find(brume_context *context, uint32_t index, cl_device_id *out) {
    cl_device_id devices[MAX_DEVICES];
    cl_int code;
    uint32_t count = list_devices(context, devices, &code);
    if (count == 0 && !is_absence(code)) return brume_fail_cl(context, code, "listing OpenCL devices");
    if (count == 0)
        return brume_fail(context, BRUME_ERROR_NO_DEVICE,
                          "no OpenCL device%s%s: install a driver (on Debian or Ubuntu: apt install pocl-opencl-icd)",
                          code == CL_SUCCESS ? "" : ", ", code == CL_SUCCESS ? "" : brume_cl_error_name(code));
    if (index == BRUME_DEVICE_ANY) {
        int best = -1;
        for (uint32_t i = 0; i < count; i++) {
            int rank = preference(devices[i]);
            if (rank > best) {
                best = rank;
                index = i;
            }
        }
    }
    if (index >= count)
        return brume_fail(context, BRUME_ERROR_NO_DEVICE, "device %u: there are %u, numbered from 0", index, count);
    *out = devices[index];
    return BRUME_OK;
}

brume_result brume_device_describe(brume_context *context, uint32_t index, brume_device_info *out) {
    if (!context || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_describe: NULL argument");
    cl_device_id id;
    brume_result result = brume_device_find(context, index, &id);
    return result == BRUME_OK ? describe(context, id, out) : result;
}

brume_result brume_device_open_id(brume_context *context, cl_device_id id, int is_part, brume_device **out) {
    brume_device *device = calloc(1, sizeof *device);
    if (!device) {
        if (is_part) clReleaseDevice(id);
        return brume_fail(context, BRUME_ERROR_MEMORY, "opening a device: out of memory");
    }
    device->references = 1;
    device->context = brume_context_retain(context);
    device->id = id;
    device->is_part = is_part;
    brume_result result = describe(context, id, &device->info);
    if (result != BRUME_OK) {
        brume_device_destroy(device);
        return result;
    }
    cl_ulong largest = 0;
    cl_int code = clGetDeviceInfo(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, sizeof largest, &largest, NULL);
    device->largest_buffer = largest;
    if (code == CL_SUCCESS) device->cl = clCreateContext(NULL, 1, &id, NULL, NULL, &code);
    if (code == CL_SUCCESS) device->queue = clCreateCommandQueue(device->cl, id, 0, &code);
    if (code != CL_SUCCESS) {
        result = brume_fail_cl(context, code, "opening the device");
        brume_device_destroy(device);
        return result;
    }
    *out = device;
    return BRUME_OK;
}

brume_result brume_device_open(brume_context *context, uint32_t index, brume_device **out) {
    if (!context || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_open: NULL argument");
    cl_device_id id;
    BRUME_TRY(brume_device_find(context, index, &id));
    return brume_device_open_id(context, id, 0, out);
}

brume_device *brume_device_retain(brume_device *device) {
    device->references++;
    return device;
}

void brume_device_destroy(brume_device *device) {
    if (!device || --device->references > 0) return;
    if (device->queue) clReleaseCommandQueue(device->queue);
    if (device->cl) clReleaseContext(device->cl);
    if (device->is_part) clReleaseDevice(device->id);
    for (uint32_t i = 0; i < device->member_count; i++) brume_device_destroy(device->members[i]);
    free(device->members);
    brume_context_release(device->context);
    free(device);
}
