/* test_extreme_lamps.c -- light that one lamp scatters once towards the eye, with every parameter at its extremes, two
 * by two, against quadrature in double.
 *
 * The ray runs along +z from the origin to a black wall; the lamp stands beside it, off its plane by a little, and a
 * spot shines at right angles to it. It is not nearer to the ray than a thirtieth of its distance: closer by, fog of
 * g = 0.9999 takes more samples than there are here.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "known_answer.h"
#include "pairwise.h"
#include "planted.h"
#include "stability.h"
#include "stats.h"

enum { SIGMA, ALBEDO, G, LAMP, PLACE, INTENSITY, SCALE, PARAMETERS };
enum { SAMPLES = 16 };
#define LENGTH 4.0
#define MOST_ERRORS 5.0 /* p = 6e-7 for each */
#define ROUNDING 1e-5   /* relative, on top */

typedef struct glow {
    double sigma, albedo, g, cutoff, beam; /* cutoff 0: a point */
    double aside, off, along;              /* place of the lamp */
    double intensity, scale;
} glow;

static glow glow_of(const unsigned char *row) {
    static const double sigmas[] = {0, 1e-12, 0.5, 30, 1e6}, albedos[] = {0.5, 1 - 0x1p-24, 1};
    static const double gs[] = {-0.9999, -0.5, 0.5, 0.9999}, intensities[] = {1e-30, 1, 1e30};
    static const double scales[] = {1e-6, 1, 1e6};
    static const double cones[][2] = {{0, 0},   {0.001, 0.00075}, {0.001, 0.001}, {20, 0},
                                      {90, 90}, {180, 0},         {180, 180}};
    static const double places[][3] = {{1, 0, 1}, {0.1, 0, 3}, {1000, 0.005, 1}, {0.5, 0, -1}, {2, 0.000005, 2.5}};
    const double *cone = cones[row[LAMP]], *place = places[row[PLACE]];
    glow w = {sigmas[row[SIGMA]], albedos[row[ALBEDO]], gs[row[G]], cone[0], cone[1], place[0], place[1], place[2],
              intensities[row[INTENSITY]], scales[row[SCALE]]};
    return w;
}

/* ---- the number -------------------------------------------------------------------------------------------------- */

/* At the angle x at which the lamp, h from the ray, sees the point; lengths as if the scale were 1. */
static double value_at(const glow *w, double h, double x) {
    double from = h * tan(x), r = h / cos(x), t = w->along + from, cosine = -sin(x), g = w->g;
    double fade = 1, angle = atan2(hypot(from, w->off), w->aside) * (180 / PI);
    if (w->cutoff > 0)
        fade = angle <= w->beam ? 1 : angle >= w->cutoff ? 0 : (w->cutoff - angle) / (w->cutoff - w->beam);
    double d = (1 - g) * (1 - g) + 2 * g * (1 - cosine);
    if (g < 0) /* what cancels in it is 1 + cosine then */
        d = (1 + g) * (1 + g) - 2 * g * (1 + cosine);
    return fade * exp(-w->sigma * (t + r)) * (1 - g * g) / (4 * PI * d * sqrt(d)) / h;
}

static double refine(const glow *w, double h, double a, double b, double whole, double tolerance, int levels) {
    double parts[2] = {0, 0}, weight;
    for (int k = 0; k < 16; k++) {
        double x = stats_gauss_node(k, 2, b - a, &weight);
        parts[k / 8] += weight * value_at(w, h, a + x);
    }
    double sum = parts[0] + parts[1];
    if (levels == 0 || fabs(sum - whole) <= fmax(tolerance, 1e-12 * sum))
        return sum;
    return refine(w, h, a, (a + b) / 2, parts[0], tolerance / 2, levels - 1) +
           refine(w, h, (a + b) / 2, b, parts[1], tolerance / 2, levels - 1);
}

/* How far from the closest point the cone of this angle reaches along the ray; < 0: nowhere. */
static double reach(const glow *w, double degrees) {
    if (w->cutoff == 0 || degrees >= 90)
        return INFINITY;
    double across = w->aside * tan(degrees * (PI / 180));
    return across > w->off ? sqrt((across - w->off) * (across + w->off)) : -1;
}

static double expected(const glow *w) {
    enum { PIECES = 64 };
    double h = hypot(w->aside, w->off), outer = reach(w, w->cutoff), inner = fmax(reach(w, w->beam), 0);
    double cuts[5] = {-w->along, -inner, 0, inner, LENGTH - w->along}, sum = 0, rough = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 4; i++) {
            double low = fmax(cuts[0], fmax(-outer, i ? cuts[i] : -INFINITY));
            double high = fmin(cuts[4], fmin(outer, i < 3 ? cuts[i + 1] : INFINITY));
            double a = atan(low / h), b = atan(high / h);
            if (!(a < b) || outer < 0)
                continue;
            for (int k = 0; k < PIECES; k++) {
                double x0 = a + (b - a) * k / PIECES, x1 = a + (b - a) * (k + 1) / PIECES;
                if (pass == 0)
                    rough += refine(w, h, x0, x1, 0, 0, 0);
                else
                    sum += refine(w, h, x0, x1, 0, 1e-11 * rough / PIECES, 20);
            }
        }
    return w->intensity * w->sigma * w->albedo * sum;
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

/* sigma is per unit of scale; so the radiance falls with its square. */
static brume_scene *glow_scene(const glow *w) {
    brume_scene *scene = new_scene(2, SAMPLES);
    const double s = w->scale;
    brume_sensor_desc sensor = brume_sensor_desc_default();
    view_matrix(&along_z, sensor.to_world);
    sensor.fov = 1e-8f; /* narrower than the narrowest beam, seen from here */
    sensor.near_clip = (float)(1e-12 * s);
    sensor.far_clip = (float)(1e6 * s);
    sensor.medium = add_medium(scene, w->sigma / s, w->albedo, w->g, 0);
    must(brume_scene_set_sensor(scene, &sensor));
    const view lamp = {{w->aside * s, w->off * s, w->along * s}, {-1, 0, 0}, {0, 1, 0}, 0};
    brume_light_desc desc = brume_light_desc_default(w->cutoff > 0 ? BRUME_LIGHT_SPOT : BRUME_LIGHT_POINT);
    view_matrix(&lamp, desc.to_world);
    set_all(desc.intensity, w->intensity);
    if (w->cutoff > 0) {
        desc.cutoff_angle = (float)w->cutoff;
        desc.beam_width = (float)w->beam;
    }
    must(brume_scene_add_light(scene, &desc, NULL));
    add_wall(scene, LENGTH * s, 0.5 * s, 0);
    return scene;
}

/* As floats hold it. */
static glow rounded(glow w) {
    w.sigma = (double)(float)(w.sigma / w.scale) * w.scale;
    w.albedo = (float)w.albedo;
    w.g = (float)w.g;
    w.cutoff = (float)w.cutoff;
    w.beam = (float)w.beam;
    w.intensity = (float)w.intensity;
    return w;
}

/* In standard errors beyond ROUNDING; infinite if anything is negative or no number. */
static double off_as(const brume_render_desc *desc, const glow *given, double *relative, double *precision) {
    const glow w = rounded(*given);
    const double right = expected(&w) / (w.scale * w.scale);
    brume_scene *scene = glow_scene(given);
    float pixels[PIXELS * PIXELS * 3];
    render_pixels(scene, desc, pixels);
    brume_scene_destroy(scene);
    for (int i = 0; i < PIXELS * PIXELS * 3; i++)
        if (!(pixels[i] >= 0 && pixels[i] <= 3e38f))
            return INFINITY;
    estimate e = estimate_of(pixels);
    /* Digits go, and then all, where a float's range ends: what fog leaves of the lamp is one. */
    double off = fabs(e.mean[0] - right), beyond = off - ROUNDING * right - fmax(1e-38, 1e-30 * w.intensity);
    *relative = right > 0 ? e.mean[0] / right - 1 : 0;
    *precision = e.error[0] / right;
    return beyond <= 0 ? 0 : beyond / e.error[0];
}

static double off_by(const glow *given, double *relative) {
    brume_render_desc desc = climb(BRUME_STRATEGY_AUTO, SAMPLES);
    double precision;
    desc.generic = 1; /* one program for all */
    return off_as(&desc, given, relative, &precision);
}

static void every_two_extremes(void **state) {
    pairwise table = {PARAMETERS, {5, 3, 4, 7, 5, 3, 3}, 0, {{0}}};
    double worst = -1;
    char where[200] = "";
    int bad = 0, dark = 0;
    (void)state;
    NEEDS_DEVICE();
    pairwise_fill(&table);
    assert_int_equal(pairwise_missing(&table), 0);
    for (int i = 0; i < table.count; i++) {
        glow w = glow_of(table.rows[i]);
        double relative = 0, off = off_by(&w, &relative);
        char here[200];
        snprintf(here, sizeof here, "sigma %g albedo %.9g g %g cone %g/%g at (%g, %g, %g) I %g scale %g", w.sigma,
                 w.albedo, w.g, w.cutoff, w.beam, w.aside, w.off, w.along, w.intensity, w.scale);
        print_message("%-110s %.2e, %.2f standard errors%s\n", here, relative, off, relative == 0 ? " (dark)" : "");
        bad += off > MOST_ERRORS;
        dark += relative == 0;
        if (off > worst) {
            worst = off;
            memcpy(where, here, sizeof where);
        }
    }
    print_message("%d rays, %d of them dark; %d wrong\n", table.count, dark, bad);
    stability_row("extreme", "fog, lamp, cone, place, power and scale, two by two", "quadrature in double",
                  "standard errors", MOST_ERRORS, worst, "%s", where);
}

/* Every way to find the light of a lamp beside the ray, whatever the phase function. The plainest finds none at all. */
static double strategy_off_by(brume_strategy strategy, double g, double *relative) {
    const glow w = {0.5, 0.9, g, 60, 40, 1, 0.1, 2, 1, 1};
    brume_render_desc desc = climb(strategy, 256);
    double precision;
    desc.generic = 1;
    desc.lanes = 1; /* builds sooner */
    double off = off_as(&desc, &w, relative, &precision);
    print_message("%-17s g %5g: %+.2e, standard error %.1e: %.2f\n", brume_strategy_name(strategy), g, *relative,
                  precision, off);
    if (!(precision < 0.01))
        fail_msg("%s, g %g: a standard error of %.2g says too little", brume_strategy_name(strategy), g, precision);
    return off;
}

static void every_strategy(void **state) {
    static const double gs[] = {-0.9, 0, 0.9, 0.99};
    (void)state;
    NEEDS_DEVICE();
    for (int k = BRUME_STRATEGY_DISTANCE; brume_strategy_name((brume_strategy)k); k++) {
        double worst = -1, where = 0, relative;
        char name[64];
        for (int i = 0; i < 4; i++) {
            double off = strategy_off_by((brume_strategy)k, gs[i], &relative);
            where = off > worst ? gs[i] : where;
            worst = fmax(worst, off);
        }
        snprintf(name, sizeof name, "a spot in fog by strategy %s", brume_strategy_name((brume_strategy)k));
        stability_row("extreme", name, "quadrature in double", "standard errors", MOST_ERRORS, worst,
                      "of g -0.9, 0, 0.9, 0.99: %g", where);
    }
    planted_bug("scatter_point.h", "real density = g.D /", "real density = R(0.98) * g.D /");
    double relative, wrong = strategy_off_by(BRUME_STRATEGY_EQUIANGULAR, 0, &relative);
    planted_remove();
    assert_true(wrong > MOST_ERRORS);
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; glow w; } plants[] = {
        {"beam.h", "s = phase_g < R(0) ? -s : s;", "", {0.5, 0.5, -0.5, 20, 0, 1, 0, 1, 1, 1}},
        {"beam.h", "square(out_of_plane) / (R(1) + g.rho)", "R(1) - g.rho",
         {0.5, 0.5, 0.5, 0.001, 0.001, 2, 2e-5, 2.5, 1, 1}},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        double relative, right = off_by(&plants[i].w, &relative);
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        double wrong = off_by(&plants[i].w, &relative);
        planted_remove();
        print_message("%s: off by %.2e, %.2f standard errors, without it %.2f\n", plants[i].right, relative, wrong,
                      right);
        if (!(right <= MOST_ERRORS && wrong > MOST_ERRORS))
            fail_msg("%s was not noticed", plants[i].right);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_two_extremes),
        cmocka_unit_test(every_strategy),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
