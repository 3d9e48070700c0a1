/* open_device.c -- see open_device.h. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "device.h"
#include "open_device.h"
#include "planted.h"

brume_context *context;
brume_device *device;

static void log_warning(void *user, brume_log_level level, const char *message) {
    (void)user;
    if (level <= BRUME_LOG_WARNING)
        print_message("%s\n", message);
}

int open_context(void **state) {
    (void)state;
    if (brume_context_create(&context) != BRUME_OK)
        return -1;
    brume_context_set_log(context, log_warning, NULL);
    return 0;
}

int open_device(void **state) {
    uint32_t count = 0;
    if (open_context(state) != 0)
        return -1;
    if (brume_device_count(context, &count) != BRUME_OK || count == 0)
        return 0;
    return brume_device_open(context, BRUME_DEVICE_ANY, &device) == BRUME_OK ? 0 : -1;
}

int close_device(void **state) {
    (void)state;
    planted_remove();
    brume_device_destroy(device);
    brume_context_destroy(context);
    return 0;
}

void must(brume_result result) {
    if (result != BRUME_OK)
        fail_msg("%s: %s", brume_result_name(result), brume_context_message(context));
}

cl_mem upload_bytes(const void *data, size_t size) {
    cl_int code;
    char nothing[16] = {0};
    cl_mem m = clCreateBuffer(device->cl, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, size ? size : sizeof nothing,
                              size ? (void *)(uintptr_t)data : nothing, &code);
    assert_int_equal(code, CL_SUCCESS);
    return m;
}
