/* cl_shim.c -- see cl_shim.h. */
#define _GNU_SOURCE
#include "cl_shim.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#define DRIVER_BEGINS() __lsan_disable() /* what drivers keep for good is not brume's to free */
#define DRIVER_ENDS() __lsan_enable()
#else
#define DRIVER_BEGINS() (void)0
#define DRIVER_ENDS() (void)0
#endif

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_t main_thread;
static unsigned calls[CL_FUNCTION_COUNT][2];
static int outstanding, armed, fired;
static cl_fault fault;
static cl_ulong memory_all, memory_at_once;
static double speed, now, longest;
static size_t most_items;
static cl_command_queue dragged[2];
static double drags[2];
static __thread int inside;

static const char *const names[CL_FUNCTION_COUNT] = {
    "clGetPlatformIDs", "clGetPlatformInfo", "clGetDeviceIDs", "clGetDeviceInfo", "clCreateContext",
    "clCreateCommandQueue", "clCreateBuffer", "clGetMemObjectInfo", "clCreateProgramWithSource",
    "clCreateProgramWithBinary", "clBuildProgram", "clGetProgramInfo", "clGetProgramBuildInfo", "clCreateKernel", "clCreateKernelsInProgram",
    "clSetKernelArg", "clEnqueueFillBuffer", "clEnqueueReadBuffer", "clEnqueueWriteBuffer",
    "clEnqueueNDRangeKernel", "clFinish", "clReleaseMemObject", "clReleaseKernel", "clReleaseProgram",
    "clReleaseCommandQueue", "clReleaseContext", "clEnqueueReadBufferRect", "clEnqueueWriteBufferRect",
    "clCreateSubDevices", "clReleaseDevice"};

const char *cl_shim_name(cl_function function) { return names[function]; }

#define WANT CL_OUT_OF_RESOURCES, CL_OUT_OF_HOST_MEMORY
static const cl_int errors[CL_FUNCTION_COUNT][8] = {
    {CL_OUT_OF_HOST_MEMORY, -1001},
    {CL_INVALID_PLATFORM, CL_OUT_OF_HOST_MEMORY},
    {CL_DEVICE_NOT_FOUND, WANT},
    {CL_INVALID_DEVICE, CL_INVALID_VALUE, WANT},
    {CL_DEVICE_NOT_AVAILABLE, CL_INVALID_DEVICE, WANT},
    {CL_INVALID_CONTEXT, CL_INVALID_DEVICE, WANT},
    {CL_INVALID_CONTEXT, CL_INVALID_BUFFER_SIZE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_INVALID_MEM_OBJECT, WANT},
    {CL_INVALID_CONTEXT, WANT},
    {CL_INVALID_CONTEXT, CL_INVALID_BINARY, WANT},
    {CL_BUILD_PROGRAM_FAILURE, CL_COMPILER_NOT_AVAILABLE, CL_INVALID_BUILD_OPTIONS, CL_INVALID_OPERATION, WANT},
    {CL_INVALID_PROGRAM, WANT},
    {CL_INVALID_PROGRAM, WANT},
    {CL_INVALID_PROGRAM_EXECUTABLE, CL_INVALID_KERNEL_NAME, CL_INVALID_KERNEL_DEFINITION, WANT},
    {CL_INVALID_PROGRAM_EXECUTABLE, WANT},
    {CL_INVALID_ARG_INDEX, CL_INVALID_ARG_VALUE, CL_INVALID_ARG_SIZE, CL_INVALID_MEM_OBJECT, WANT},
    {CL_INVALID_COMMAND_QUEUE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_INVALID_COMMAND_QUEUE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_INVALID_COMMAND_QUEUE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_INVALID_KERNEL_ARGS, CL_INVALID_WORK_GROUP_SIZE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_INVALID_COMMAND_QUEUE, WANT},
    {CL_INVALID_MEM_OBJECT, WANT},
    {CL_INVALID_KERNEL, WANT},
    {CL_INVALID_PROGRAM, WANT},
    {CL_INVALID_COMMAND_QUEUE, WANT},
    {CL_INVALID_CONTEXT, WANT},
    {CL_INVALID_COMMAND_QUEUE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_INVALID_COMMAND_QUEUE, CL_MEM_OBJECT_ALLOCATION_FAILURE, WANT},
    {CL_DEVICE_PARTITION_FAILED, CL_INVALID_DEVICE_PARTITION_COUNT, WANT},
    {CL_INVALID_DEVICE, WANT},
};

const cl_int *cl_shim_errors(cl_function function) { return errors[function]; }

const char *cl_shim_error_name(cl_int code) {
#define NAME(x) case x: return #x
    switch (code) {
    NAME(CL_DEVICE_NOT_FOUND); NAME(CL_DEVICE_NOT_AVAILABLE); NAME(CL_COMPILER_NOT_AVAILABLE);
    NAME(CL_MEM_OBJECT_ALLOCATION_FAILURE); NAME(CL_OUT_OF_RESOURCES); NAME(CL_OUT_OF_HOST_MEMORY);
    NAME(CL_BUILD_PROGRAM_FAILURE); NAME(CL_INVALID_VALUE); NAME(CL_INVALID_PLATFORM); NAME(CL_INVALID_DEVICE);
    NAME(CL_INVALID_CONTEXT); NAME(CL_INVALID_COMMAND_QUEUE); NAME(CL_INVALID_MEM_OBJECT); NAME(CL_INVALID_BINARY);
    NAME(CL_INVALID_BUILD_OPTIONS); NAME(CL_INVALID_PROGRAM); NAME(CL_INVALID_PROGRAM_EXECUTABLE);
    NAME(CL_INVALID_KERNEL_NAME); NAME(CL_INVALID_KERNEL_DEFINITION); NAME(CL_INVALID_KERNEL);
    NAME(CL_INVALID_ARG_INDEX); NAME(CL_INVALID_ARG_VALUE); NAME(CL_INVALID_ARG_SIZE); NAME(CL_INVALID_KERNEL_ARGS);
    NAME(CL_INVALID_WORK_GROUP_SIZE); NAME(CL_INVALID_OPERATION); NAME(CL_INVALID_BUFFER_SIZE);
    NAME(CL_DEVICE_PARTITION_FAILED); NAME(CL_INVALID_DEVICE_PARTITION_COUNT);
    case -1001: return "CL_PLATFORM_NOT_FOUND_KHR";
    }
#undef NAME
    return "?";
}

/* ---- what is to fail ------------------------------------------------------------------------------------------- */

void cl_shim_reset(void) {
    pthread_mutex_lock(&lock);
    memset(calls, 0, sizeof calls);
    armed = fired = 0;
    main_thread = pthread_self();
    pthread_mutex_unlock(&lock);
}

void cl_shim_arm(const cl_fault *wanted) {
    pthread_mutex_lock(&lock);
    fault = *wanted;
    armed = 1;
    fired = 0;
    pthread_mutex_unlock(&lock);
}

int cl_shim_disarm(void) {
    pthread_mutex_lock(&lock);
    armed = 0;
    int was = fired;
    pthread_mutex_unlock(&lock);
    return was;
}

int cl_shim_fired(void) {
    pthread_mutex_lock(&lock);
    int was = fired;
    pthread_mutex_unlock(&lock);
    return was;
}

unsigned cl_shim_calls(cl_function function, int in_thread) { return calls[function][in_thread]; }
int cl_shim_outstanding(void) { return outstanding; }

void cl_shim_set_memory(cl_ulong all, cl_ulong at_once) {
    memory_all = all;
    memory_at_once = at_once;
}

void cl_shim_set_speed(double seconds_per_sample) {
    speed = seconds_per_sample;
    longest = 0;
    main_thread = pthread_self();
}

double cl_shim_longest_launch(void) { return longest; }
void cl_shim_set_most_items(size_t items) { most_items = items; }

void cl_shim_set_drag(int which, cl_command_queue queue, double seconds_per_sample) {
    dragged[which] = queue;
    drags[which] = seconds_per_sample;
}

int cl_shim_inside(void) { return inside; }

/* The call's error, CL_SUCCESS for none. */
static cl_int meet(cl_function function, cl_manner *manner) {
    pthread_mutex_lock(&lock);
    int in_thread = !pthread_equal(pthread_self(), main_thread);
    unsigned n = ++calls[function][in_thread];
    int here = armed && function == fault.function && in_thread == fault.in_thread;
    int later = armed && fired && (fault.manner == CL_LOST || (fault.manner == CL_FULL && here));
    cl_int code = (here && n == fault.n) || later ? fault.code : CL_SUCCESS;
    *manner = fault.manner;
    if (code != CL_SUCCESS) fired = 1;
    pthread_mutex_unlock(&lock);
    return code;
}

static void count(int change) {
    pthread_mutex_lock(&lock);
    outstanding += change;
    pthread_mutex_unlock(&lock);
}

/* Nothing in the program refers to libOpenCL any more, and linkers may leave it out. */
static void *real(const char *name) {
    static void *library;
    if (!library) library = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL);
    void *found = library ? dlsym(library, name) : NULL;
    if (found) return found;
    fprintf(stderr, "there is no %s in libOpenCL.so.1\n", name);
    abort();
}

static void enter(void) {
    inside++;
    DRIVER_BEGINS();
}

static void leave(void) {
    DRIVER_ENDS();
    inside--;
}

/* An entry point that returns an error code: FAIL is what is done in place of the call. */
#define PLAIN(function, name, parameters, arguments)                                                                   \
    CL_API_ENTRY cl_int CL_API_CALL name parameters {                                                                  \
        cl_manner manner;                                                                                              \
        cl_int code = meet(function, &manner);                                                                         \
        if (code != CL_SUCCESS) return code;                                                                           \
        cl_int(CL_API_CALL *call) parameters;                                                                          \
        *(void **)&call = real(#name);                                                                                 \
        enter();                                                                                                       \
        code = call arguments;                                                                                         \
        leave();                                                                                                       \
        return code;                                                                                                   \
    }

/* One that returns an object, and the code by a pointer behind its other parameters. */
#define CREATE(function, type, name, parameters, arguments)                                                            \
    CL_API_ENTRY type CL_API_CALL name parameters {                                                                    \
        cl_manner manner;                                                                                              \
        cl_int code = meet(function, &manner);                                                                         \
        if (code != CL_SUCCESS) {                                                                                      \
            *error = code;                                                                                             \
            return NULL;                                                                                               \
        }                                                                                                              \
        type(CL_API_CALL *call) parameters;                                                                            \
        *(void **)&call = real(#name);                                                                                 \
        enter();                                                                                                       \
        type made = call arguments;                                                                                    \
        leave();                                                                                                       \
        if (made) count(1);                                                                                            \
        return made;                                                                                                   \
    }

/* One that releases an object: whatever it returns, the caller has done its part. */
#define RELEASE(function, type, name)                                                                                  \
    CL_API_ENTRY cl_int CL_API_CALL name(type object) {                                                                \
        cl_manner manner;                                                                                              \
        cl_int code = meet(function, &manner);                                                                         \
        cl_int(CL_API_CALL *call)(type);                                                                               \
        *(void **)&call = real(#name);                                                                                 \
        enter();                                                                                                       \
        cl_int done = call(object);                                                                                    \
        leave();                                                                                                       \
        count(-1);                                                                                                     \
        return code != CL_SUCCESS ? code : done;                                                                       \
    }

PLAIN(CL_GET_PLATFORM_IDS, clGetPlatformIDs, (cl_uint room, cl_platform_id *out, cl_uint *number), (room, out, number))
PLAIN(CL_GET_PLATFORM_INFO, clGetPlatformInfo,
      (cl_platform_id platform, cl_platform_info what, size_t size, void *value, size_t *needed),
      (platform, what, size, value, needed))
PLAIN(CL_GET_DEVICE_IDS, clGetDeviceIDs,
      (cl_platform_id platform, cl_device_type type, cl_uint room, cl_device_id *out, cl_uint *number),
      (platform, type, room, out, number))
CREATE(CL_CREATE_CONTEXT, cl_context, clCreateContext,
       (const cl_context_properties *properties, cl_uint number, const cl_device_id *devices,
        void(CL_CALLBACK *notify)(const char *, const void *, size_t, void *), void *user, cl_int *error),
       (properties, number, devices, notify, user, error))
CREATE(CL_CREATE_COMMAND_QUEUE, cl_command_queue, clCreateCommandQueue,
       (cl_context context, cl_device_id device, cl_command_queue_properties properties, cl_int *error),
       (context, device, properties, error))
CREATE(CL_CREATE_BUFFER, cl_mem, clCreateBuffer,
       (cl_context context, cl_mem_flags flags, size_t size, void *data, cl_int *error),
       (context, flags, size, data, error))
PLAIN(CL_GET_MEM_OBJECT_INFO, clGetMemObjectInfo,
      (cl_mem buffer, cl_mem_info what, size_t size, void *value, size_t *needed), (buffer, what, size, value, needed))
CREATE(CL_CREATE_PROGRAM_WITH_SOURCE, cl_program, clCreateProgramWithSource,
       (cl_context context, cl_uint number, const char **texts, const size_t *lengths, cl_int *error),
       (context, number, texts, lengths, error))
CREATE(CL_CREATE_PROGRAM_WITH_BINARY, cl_program, clCreateProgramWithBinary,
       (cl_context context, cl_uint number, const cl_device_id *devices, const size_t *lengths,
        const unsigned char **binaries, cl_int *status, cl_int *error),
       (context, number, devices, lengths, binaries, status, error))
PLAIN(CL_BUILD_PROGRAM, clBuildProgram,
      (cl_program program, cl_uint number, const cl_device_id *devices, const char *options,
       void(CL_CALLBACK *notify)(cl_program, void *), void *user),
      (program, number, devices, options, notify, user))
PLAIN(CL_GET_PROGRAM_INFO, clGetProgramInfo,
      (cl_program program, cl_program_info what, size_t size, void *value, size_t *needed),
      (program, what, size, value, needed))
PLAIN(CL_GET_PROGRAM_BUILD_INFO, clGetProgramBuildInfo,
      (cl_program program, cl_device_id device, cl_program_build_info what, size_t size, void *value, size_t *needed),
      (program, device, what, size, value, needed))
CREATE(CL_CREATE_KERNEL, cl_kernel, clCreateKernel, (cl_program program, const char *name, cl_int *error),
       (program, name, error))
PLAIN(CL_CREATE_KERNELS_IN_PROGRAM, clCreateKernelsInProgram,
      (cl_program program, cl_uint room, cl_kernel *out, cl_uint *number), (program, room, out, number))
PLAIN(CL_ENQUEUE_FILL_BUFFER, clEnqueueFillBuffer,
      (cl_command_queue queue, cl_mem buffer, const void *pattern, size_t pattern_size, size_t offset, size_t size,
       cl_uint waits, const cl_event *wait, cl_event *event),
      (queue, buffer, pattern, pattern_size, offset, size, waits, wait, event))
PLAIN(CL_ENQUEUE_READ_BUFFER, clEnqueueReadBuffer,
      (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size, void *to, cl_uint waits,
       const cl_event *wait, cl_event *event),
      (queue, buffer, blocking, offset, size, to, waits, wait, event))
PLAIN(CL_ENQUEUE_WRITE_BUFFER, clEnqueueWriteBuffer,
      (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size, const void *from,
       cl_uint waits, const cl_event *wait, cl_event *event),
      (queue, buffer, blocking, offset, size, from, waits, wait, event))
PLAIN(CL_ENQUEUE_READ_BUFFER_RECT, clEnqueueReadBufferRect,
      (cl_command_queue queue, cl_mem buffer, cl_bool blocking, const size_t *at, const size_t *to_at,
       const size_t *region, size_t row, size_t slice, size_t to_row, size_t to_slice, void *to, cl_uint waits,
       const cl_event *wait, cl_event *event),
      (queue, buffer, blocking, at, to_at, region, row, slice, to_row, to_slice, to, waits, wait, event))
PLAIN(CL_ENQUEUE_WRITE_BUFFER_RECT, clEnqueueWriteBufferRect,
      (cl_command_queue queue, cl_mem buffer, cl_bool blocking, const size_t *at, const size_t *from_at,
       const size_t *region, size_t row, size_t slice, size_t from_row, size_t from_slice, const void *from,
       cl_uint waits, const cl_event *wait, cl_event *event),
      (queue, buffer, blocking, at, from_at, region, row, slice, from_row, from_slice, from, waits, wait, event))
RELEASE(CL_RELEASE_MEM_OBJECT, cl_mem, clReleaseMemObject)
RELEASE(CL_RELEASE_KERNEL, cl_kernel, clReleaseKernel)
RELEASE(CL_RELEASE_PROGRAM, cl_program, clReleaseProgram)
RELEASE(CL_RELEASE_COMMAND_QUEUE, cl_command_queue, clReleaseCommandQueue)
RELEASE(CL_RELEASE_CONTEXT, cl_context, clReleaseContext)
RELEASE(CL_RELEASE_DEVICE, cl_device_id, clReleaseDevice)

CL_API_ENTRY cl_int CL_API_CALL clCreateSubDevices(cl_device_id device, const cl_device_partition_property *how,
                                                   cl_uint room, cl_device_id *out, cl_uint *number) {
    cl_manner manner;
    cl_int code = meet(CL_CREATE_SUB_DEVICES, &manner);
    if (code != CL_SUCCESS) return code;
    cl_int(CL_API_CALL *call)(cl_device_id, const cl_device_partition_property *, cl_uint, cl_device_id *, cl_uint *);
    *(void **)&call = real("clCreateSubDevices");
    enter();
    code = call(device, how, room, out, number);
    leave();
    if (code == CL_SUCCESS) count((int)*number);
    return code;
}

CL_API_ENTRY cl_int CL_API_CALL clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t size, void *value,
                                                size_t *needed) {
    cl_manner manner;
    cl_int code = meet(CL_GET_DEVICE_INFO, &manner);
    if (code != CL_SUCCESS) return code;
    cl_int(CL_API_CALL *call)(cl_device_id, cl_device_info, size_t, void *, size_t *);
    *(void **)&call = real("clGetDeviceInfo");
    enter();
    code = call(device, what, size, value, needed);
    leave();
    cl_ulong said = what == CL_DEVICE_GLOBAL_MEM_SIZE ? memory_all
                    : what == CL_DEVICE_MAX_MEM_ALLOC_SIZE ? memory_at_once : 0;
    if (said && code == CL_SUCCESS && value) memcpy(value, &said, sizeof said);
    return code;
}

/* ---- launches -------------------------------------------------------------------------------------------------- */

static cl_uint samples_of_launch; /* the last but one argument of brume's kernel, set by the main thread */
static __thread cl_uint samples_of_this; /* by any */

CL_API_ENTRY cl_int CL_API_CALL clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void *value) {
    cl_manner manner;
    cl_int code = meet(CL_SET_KERNEL_ARG, &manner);
    if (code != CL_SUCCESS) return code;
    cl_int(CL_API_CALL *call)(cl_kernel, cl_uint, size_t, const void *);
    *(void **)&call = real("clSetKernelArg");
    enter();
    code = call(kernel, index, size, value);
    leave();
    if (index == 26 && size == sizeof samples_of_this) memcpy(&samples_of_this, value, sizeof samples_of_this);
    if (index == 26 && size == sizeof samples_of_launch && pthread_equal(pthread_self(), main_thread))
        samples_of_launch = samples_of_this;
    return code;
}

CL_API_ENTRY cl_int CL_API_CALL clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                                                       const size_t *offset, const size_t *global,
                                                       const size_t *local, cl_uint waits, const cl_event *wait,
                                                       cl_event *event) {
    cl_manner manner;
    cl_int code = meet(CL_ENQUEUE_ND_RANGE_KERNEL, &manner);
    if (code == CL_SUCCESS && most_items && *global > most_items) {
        fired = 1;
        return CL_OUT_OF_RESOURCES;
    }
    size_t items = *global;
    if (code != CL_SUCCESS && manner == CL_HALF) items = *global / *local / 2 * *local;
    if (code != CL_SUCCESS && (manner != CL_HALF || items == 0)) return code;
    cl_int(CL_API_CALL *call)(cl_command_queue, cl_kernel, cl_uint, const size_t *, const size_t *, const size_t *,
                              cl_uint, const cl_event *, cl_event *);
    *(void **)&call = real("clEnqueueNDRangeKernel");
    enter();
    cl_int done = call(queue, kernel, dimensions, offset, &items, local, waits, wait, event);
    leave();
    if (speed > 0 && pthread_equal(pthread_self(), main_thread)) {
        double seconds = speed * (double)items * samples_of_launch;
        now += seconds;
        if (seconds > longest) longest = seconds;
    }
    for (int i = 0; i < 2; i++) {
        if (queue != dragged[i]) continue;
        double seconds = drags[i] * (double)items * samples_of_this;
        struct timespec time = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
        nanosleep(&time, NULL);
    }
    return code != CL_SUCCESS ? code : done;
}

CL_API_ENTRY cl_int CL_API_CALL clFinish(cl_command_queue queue) {
    cl_manner manner;
    cl_int code = meet(CL_FINISH, &manner);
    if (code != CL_SUCCESS && manner != CL_DONE) return code;
    cl_int(CL_API_CALL *call)(cl_command_queue);
    *(void **)&call = real("clFinish");
    enter();
    cl_int done = call(queue);
    leave();
    return code != CL_SUCCESS ? code : done;
}

int clock_gettime(clockid_t which, struct timespec *out) {
    static int (*call)(clockid_t, struct timespec *);
    if (speed > 0 && !inside && which == CLOCK_MONOTONIC && pthread_equal(pthread_self(), main_thread)) {
        out->tv_sec = (time_t)now;
        out->tv_nsec = (long)(1e9 * (now - (double)out->tv_sec));
        return 0;
    }
    if (!call) *(void **)&call = dlsym(RTLD_NEXT, "clock_gettime");
    return call(which, out);
}
