/* The public header compiles alone, as strict C99 here and as C++98 in header_cxx.cc, and means the same in both. */
#include "brume.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "header_sizes.h"

static void same_layout_in_both_languages(void **state)
{
    (void)state;
    unsigned c_sizes[HEADER_SIZES], cxx_sizes[HEADER_SIZES];
    HEADER_FILL(c_sizes);
    header_sizes_cxx(cxx_sizes);
    for (int i = 0; i < HEADER_SIZES; i++)
        assert_int_equal(c_sizes[i], cxx_sizes[i]);
}

static void defaults_carry_a_cookie(void **state)
{
    (void)state;
    assert_int_not_equal(brume_texture_desc_default().cookie, 0);
    assert_int_not_equal(brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE).cookie, 0);
    assert_int_not_equal(brume_medium_desc_default().cookie, 0);
    assert_int_not_equal(brume_light_desc_default(BRUME_LIGHT_POINT).cookie, 0);
    assert_int_not_equal(brume_shape_desc_default(BRUME_SHAPE_MESH).cookie, 0);
    assert_int_not_equal(brume_sensor_desc_default().cookie, 0);
    assert_int_not_equal(brume_film_desc_default().cookie, 0);
    assert_int_not_equal(brume_integrator_desc_default().cookie, 0);
    assert_int_not_equal(brume_render_desc_default().cookie, 0);
    assert_int_not_equal(brume_picture_desc_default().cookie, 0);
    assert_int_not_equal(brume_merge_desc_default().cookie, 0);
}

static void every_result_has_a_name(void **state)
{
    (void)state;
    for (int i = BRUME_OK; i <= BRUME_ERROR_DENOISER; i++)
        assert_true(brume_result_name((brume_result)i)[0] != 0);
    /* A number that is no result must not be a NULL for printf. */
    assert_non_null(brume_result_name((brume_result)100));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_layout_in_both_languages),
        cmocka_unit_test(defaults_carry_a_cookie),
        cmocka_unit_test(every_result_has_a_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
