/* device_parts.c -- see device_parts.h. */
#include "device_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

brume_device *open_halves(void) {
    brume_device *halves[2] = {NULL, NULL}, *joined = NULL;
    if (brume_device_open_part(context, BRUME_DEVICE_ANY, 0, 2, &halves[0]) != BRUME_OK) return NULL;
    must(brume_device_open_part(context, BRUME_DEVICE_ANY, 1, 2, &halves[1]));
    must(brume_device_join(halves, 2, &joined));
    brume_device_destroy(halves[0]);
    brume_device_destroy(halves[1]);
    return joined;
}
