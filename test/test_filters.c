/* test_filters.c -- the kernels' tables of reconstruction filters against the filters as published. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "built_arrays.h"

#define PI 3.14159265358979323846

/* The filters as published, for any x; written from the papers, not from the library. */
static double published(const brume_film_desc *film, double x) {
    double t = fabs(x), b = 1.0 / 3, c = 1.0 / 3;
    switch (film->rfilter) {
    case BRUME_RFILTER_BOX: return t <= film->filter_radius;
    case BRUME_RFILTER_TENT: return fmax(0, 1 - t);
    case BRUME_RFILTER_GAUSSIAN: return t >= 2 ? 0 : exp(-2 * t * t) - exp(-8.0);
    case BRUME_RFILTER_LANCZOS:
        if (t >= 3) return 0;
        return t < 1e-9 ? 1 : sin(PI * t) / (PI * t) * sin(PI * t / 3) / (PI * t / 3);
    case BRUME_RFILTER_CATMULLROM: b = 0, c = 0.5; break;
    case BRUME_RFILTER_MITCHELL: break;
    }
    if (t < 1)
        return ((12 - 9 * b - 6 * c) * t * t * t + (-18 + 12 * b + 6 * c) * t * t + (6 - 2 * b)) / 6;
    if (t < 2)
        return ((-b - 6 * c) * t * t * t + (6 * b + 30 * c) * t * t + (-12 * b - 48 * c) * t + (8 * b + 24 * c)) / 6;
    return 0;
}

static void test_filters(void **state) {
    (void)state;
    static const double radii[6] = {0.75, 1, 2, 2, 2, 3};
    enum { FINE = 600000 };
    for (int kind = BRUME_RFILTER_BOX; kind <= BRUME_RFILTER_LANCZOS; kind++) {
        brume_scene *scene = scene_with_sensor();
        brume_film_desc film = brume_film_desc_default();
        brume_arrays a;
        film.rfilter = (brume_rfilter)kind;
        film.filter_radius = kind == BRUME_RFILTER_BOX ? 0.75f : 0;
        assert_int_equal(brume_scene_set_film(scene, &film), BRUME_OK);
        build_arrays(scene, &a);
        const int size = a.params.filter_size, zeros = (int)a.filter[size + 1];
        const float *zero = a.filter + size + 2;
        assert_int_equal(a.filter_count, size + 2 + zeros);
        assert_float_equal(a.params.filter_radius, radii[kind], 0);
        assert_float_equal(a.filter[0], -radii[kind], 0);
        assert_float_equal(a.filter[size], radii[kind], 0);

        /* Exact: masses of |f| and f, and the second moment. The table: its cumulative at every entry. */
        double h = 2 * radii[kind] / FINE, mass = 0, signed_mass = 0, moment = 0, below = 0, worst = 0;
        for (int i = 0; i < FINE; i++) {
            double x = -radii[kind] + (i + 0.5) * h, f = published(&film, x);
            mass += fabs(f) * h;
            signed_mass += f * h;
            moment += f * x * x * h;
        }
        int entry = 1;
        for (int i = 0; i < FINE; i++) {
            double x = -radii[kind] + (i + 1) * h;
            below += fabs(published(&film, x - 0.5 * h)) * h;
            while (entry < size && a.filter[entry] <= x) {
                worst = fmax(worst, fabs(below / mass - (double)entry / size));
                entry++;
            }
        }
        assert_true(worst < 1e-5); /* one step of the fine sum: at most 2 / FINE of the mass, times the peak */

        /* What the kernel gets: the mean of sign times weight is 1, and offsets spread as f does. */
        double mean = 0, spread = 0, weight = sqrt(a.params.filter_weight); /* of one axis */
        const int draws = 1 << 20;
        for (int i = 0; i < draws; i++) {
            double at = (i + 0.5) / draws * size;
            int k = (int)at;
            double x = a.filter[k] + (at - k) * ((double)a.filter[k + 1] - a.filter[k]);
            int sign = 1;
            for (int z = 0; z < zeros; z++)
                sign = fabs(x) > zero[z] ? -sign : sign;
            if (fabs(published(&film, x)) > 1e-6)
                assert_int_equal(sign, published(&film, x) > 0 ? 1 : -1);
            mean += sign * weight / draws;
            spread += sign * weight * x * x / draws;
        }
        assert_close(mean, 1, 1e-5); /* 2^20 points see a zero's place to 1e-6 of the mass, a few zeros */
        assert_close(weight, mass / signed_mass, 1e-3);
        /* Catmull and Rom's filter has no second moment: compare absolutely, in squared pixels. */
        assert_float_equal(spread, moment / signed_mass, 2e-3);
        brume_arrays_free(&a);
        brume_scene_destroy(scene);
    }
    brume_scene *scene = scene_with_sensor();
    brume_film_desc film = brume_film_desc_default();
    brume_arrays a;
    film.rfilter = BRUME_RFILTER_BOX;
    assert_int_equal(brume_scene_set_film(scene, &film), BRUME_OK);
    build_arrays(scene, &a);
    assert_int_equal(a.params.filter_size, 0);
    assert_float_equal(a.params.filter_weight, 1, 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_filters),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}
