/* built_arrays.c -- see built_arrays.h. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "built_arrays.h"

brume_scene *scene_with_sensor(void) {
    brume_scene *scene;
    brume_sensor_desc sensor = brume_sensor_desc_default();
    assert_int_equal(brume_scene_create(context, &scene), BRUME_OK);
    assert_int_equal(brume_scene_set_sensor(scene, &sensor), BRUME_OK);
    return scene;
}

void build_arrays(const brume_scene *scene, brume_arrays *arrays) {
    if (brume_arrays_build(scene, NULL, arrays) != BRUME_OK)
        fail_msg("%s", brume_context_message(context));
}

void assert_close(double value, double wanted, double relative) {
    if (!(fabs(value - wanted) <= relative * fabs(wanted)))
        fail_msg("%.9g instead of %.9g", value, wanted);
}
