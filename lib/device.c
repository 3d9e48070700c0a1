/* device.c -- finding and opening OpenCL devices. */
#include "device.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_PLATFORMS = 32, MAX_DEVICES = 64 };

static const char *cl_error_name(cl_int code) {
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
                      cl_error_name(code), (int)code);
}

/* Every device of every platform, in the order in which the drivers list them. */
static uint32_t list_devices(cl_device_id devices[MAX_DEVICES]) {
    cl_platform_id platforms[MAX_PLATFORMS];
    cl_uint platform_count = 0, count = 0;
    if (clGetPlatformIDs(MAX_PLATFORMS, platforms, &platform_count) != CL_SUCCESS) return 0;
    if (platform_count > MAX_PLATFORMS) platform_count = MAX_PLATFORMS;
    for (cl_uint p = 0; p < platform_count && count < MAX_DEVICES; p++) {
        cl_uint found = 0;
        if (clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, MAX_DEVICES - count, devices + count, &found) !=
            CL_SUCCESS)
            continue;
        count += found < MAX_DEVICES - count ? found : MAX_DEVICES - count;
    }
    return count;
}

static void get_string(cl_device_id id, cl_device_info what, char *out, size_t size) {
    char text[1024] = "";
    if (clGetDeviceInfo(id, what, sizeof text - 1, text, NULL) != CL_SUCCESS) text[0] = 0;
    size_t length = strlen(text);
    if (length >= size) length = size - 1;
    memcpy(out, text, length);
    out[length] = 0;
}

static int has_extension(cl_device_id id, const char *name) {
    size_t size = 0;
    if (clGetDeviceInfo(id, CL_DEVICE_EXTENSIONS, 0, NULL, &size) != CL_SUCCESS || size == 0) return 0;
    char *text = malloc(size + 1);
    if (!text) return 0;
    text[0] = 0;
    clGetDeviceInfo(id, CL_DEVICE_EXTENSIONS, size, text, NULL);
    text[size] = 0;
    int found = strstr(text, name) != NULL;
    free(text);
    return found;
}

static void describe(cl_device_id id, brume_device_info *info) {
    memset(info, 0, sizeof *info);
    get_string(id, CL_DEVICE_NAME, info->name, sizeof info->name);
    get_string(id, CL_DRIVER_VERSION, info->driver, sizeof info->driver);
    cl_platform_id platform = NULL;
    clGetDeviceInfo(id, CL_DEVICE_PLATFORM, sizeof platform, &platform, NULL);
    clGetPlatformInfo(platform, CL_PLATFORM_NAME, sizeof info->platform - 1, info->platform, NULL);
    cl_device_type type = 0;
    cl_ulong memory = 0;
    cl_uint units = 0, width = 0;
    clGetDeviceInfo(id, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    clGetDeviceInfo(id, CL_DEVICE_GLOBAL_MEM_SIZE, sizeof memory, &memory, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_COMPUTE_UNITS, sizeof units, &units, NULL);
    clGetDeviceInfo(id, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, sizeof width, &width, NULL);
    info->is_gpu = (type & CL_DEVICE_TYPE_GPU) != 0;
    info->compute_units = units;
    info->memory_bytes = memory;
    info->has_double = (uint32_t)has_extension(id, "cl_khr_fp64");
    info->lanes = info->is_gpu ? 1 : width >= 16 ? 16 : 8;
}

brume_result brume_device_count(brume_context *context, uint32_t *out) {
    if (!context || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_count: NULL argument");
    cl_device_id devices[MAX_DEVICES];
    *out = list_devices(devices);
    return BRUME_OK;
}

/* What BRUME_DEVICE_ANY takes first: a GPU, PoCL, another CPU, the rest. */
static int preference(cl_device_id id) {
    cl_device_type type = 0;
    cl_platform_id platform = NULL;
    char name[128] = "";
    clGetDeviceInfo(id, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    clGetDeviceInfo(id, CL_DEVICE_PLATFORM, sizeof platform, &platform, NULL);
    clGetPlatformInfo(platform, CL_PLATFORM_NAME, sizeof name - 1, name, NULL);
    if (type & CL_DEVICE_TYPE_GPU) return 3;
    if (!(type & CL_DEVICE_TYPE_CPU)) return 0;
    return strcmp(name, "Portable Computing Language") == 0 ? 2 : 1;
}

static brume_result find_device(brume_context *context, uint32_t index, cl_device_id *out) {
    cl_device_id devices[MAX_DEVICES];
    uint32_t count = list_devices(devices);
    if (count == 0)
        return brume_fail(context, BRUME_ERROR_NO_DEVICE,
                          "no OpenCL device: install a driver (on Debian or Ubuntu: apt install pocl-opencl-icd)");
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
    brume_result result = find_device(context, index, &id);
    if (result == BRUME_OK) describe(id, out);
    return result;
}

brume_result brume_device_open(brume_context *context, uint32_t index, brume_device **out) {
    if (!context || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_open: NULL argument");
    cl_device_id id;
    brume_result result = find_device(context, index, &id);
    if (result != BRUME_OK) return result;

    brume_device *device = calloc(1, sizeof *device);
    if (!device) return brume_fail(context, BRUME_ERROR_MEMORY, "opening a device: out of memory");
    device->references = 1;
    device->context = brume_context_retain(context);
    device->id = id;
    describe(id, &device->info);
    cl_int code;
    device->cl = clCreateContext(NULL, 1, &id, NULL, NULL, &code);
    if (code == CL_SUCCESS) device->queue = clCreateCommandQueue(device->cl, id, 0, &code);
    if (code != CL_SUCCESS) {
        result = brume_fail_cl(context, code, "opening the device");
        brume_device_destroy(device);
        return result;
    }
    *out = device;
    return BRUME_OK;
}

brume_device *brume_device_retain(brume_device *device) {
    device->references++;
    return device;
}

void brume_device_destroy(brume_device *device) {
    if (!device || --device->references > 0) return;
    if (device->queue) clReleaseCommandQueue(device->queue);
    if (device->cl) clReleaseContext(device->cl);
    brume_context_release(device->context);
    free(device);
}
