/* test_invariance.c -- the same scene told in other words gives the same picture: moved a million units, scaled by 1e-6
 * to 1e6, turned, brightened, in another order, in other pieces.
 *
 * Where the telling changes no digit, the pictures have the same bits. Else the pixels' differences, which are
 * independent, must have a mean of 0 (same_picture.h). Each telling has a variant that must be noticed.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "airlight.h"
#include "planted.h"
#include "same_picture.h"
#include "stability.h"
#include "stage.h"

enum { SAMPLES = 64, FEW = 8 };

static void see(const stage *told, uint32_t samples, picture *out) {
    picture_render(stage_scene(told, samples), out);
}

static void same_bits(const stage *told, const stage *other, const char *name, double factor) {
    picture a, b;
    see(told, FEW, &a);
    see(other, FEW, &b);
    stability_row("invariance", name, "the untold scene, bit for bit", "values that differ", 0,
                  picture_differing(&a, &b, factor), told->fog ? "fog" : "surfaces");
}

static void same_mean(const stage *told, const stage *other, const char *name) {
    picture a, b;
    see(told, SAMPLES, &a);
    see(other, SAMPLES, &b);
    stability_row("invariance", name, "the untold scene", "standard errors", PICTURE_MOST_ERRORS,
                  picture_errors_apart(&a, &b), told->fog ? "fog" : "surfaces");
}

static void must_be_noticed(const stage *told, const stage *other, const char *what, uint32_t samples) {
    picture a, b;
    see(told, samples, &a);
    see(other, samples, &b);
    double apart = picture_errors_apart(&a, &b);
    print_message("%s: %.1f standard errors, %d values differ\n", what, apart, picture_differing(&a, &b, 1));
    if (!(samples == FEW ? picture_differing(&a, &b, 1) > 0 : apart > PICTURE_MOST_ERRORS))
        fail_msg("%s was not noticed", what);
}

/* ---- moved ------------------------------------------------------------------------------------------------------- */

static void moved_far_away(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < 4; i++) {
        const stage told = {.fog = i / 2, .split = i % 2};
        stage other = {.fog = i / 2, .split = i % 2, .move = {1e5, -2e5, 1e5}};
        same_bits(&told, &other, "moved by 1e5", 1);
        for (int k = 0; k < 3; k++)
            other.move[k] *= -10;
        same_bits(&told, &other, "moved by 1e6", 1);
        other.bake = 1;
        if (told.split) must_be_noticed(&told, &other, "world coordinates rounded to float", FEW);
    }
}

/* ---- scaled ------------------------------------------------------------------------------------------------------ */

static void scaled_by_powers_of_two(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int fog = 0; fog < 2; fog++) {
        const stage told = {.fog = fog}, small = {.fog = fog, .scale = 0x1p-20}, large = {.fog = fog, .scale = 0x1p20};
        same_bits(&told, &small, "scaled by 2^-20", 1);
        same_bits(&told, &large, "scaled by 2^20", 1);
    }
}

static void scaled(void **state) {
    static const struct { double scale; const char *name; } cases[] = {
        {1e-6, "scaled by 1e-6"}, {1e-3, "in thousandths of the unit"}, {1e6, "scaled by 1e6"}};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < 6; i++) {
        const stage told = {.fog = i % 2}, other = {.fog = i % 2, .scale = cases[i / 2].scale};
        same_mean(&told, &other, cases[i / 2].name);
    }
    const stage told = {.fog = 1}, thick = {.fog = 1, .scale = 1e6, .sigma_factor = 1.2};
    must_be_noticed(&told, &thick, "extinction off by a fifth", SAMPLES);
}

static void brightened(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int fog = 0; fog < 2; fog++) {
        const stage told = {.fog = fog}, dim = {.fog = fog, .brightness = 0x1p-60};
        const stage bright = {.fog = fog, .brightness = 0x1p60};
        same_bits(&told, &dim, "light of 2^-60", 0x1p-60);
        same_bits(&told, &bright, "light of 2^60", 0x1p60);
    }
}

/* ---- turned ------------------------------------------------------------------------------------------------------ */

static void turned(void **state) {
    static const double turns[3][3] = {{0, 180, 0}, {90, 0, 0}, {31, 77, -113}};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < 6; i++) {
        const stage told = {.fog = i % 2};
        stage other = told;
        memcpy(other.turn, turns[i / 2], sizeof other.turn);
        same_mean(&told, &other, i / 2 == 0 ? "turned by 180 degrees" : i / 2 == 1 ? "turned by 90 degrees" : "turned");
    }
}

/* ---- in other pieces, in another order --------------------------------------------------------------------------- */

static void triangles_split(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int fog = 0; fog < 2; fog++) {
        const stage told = {.fog = fog}, other = {.fog = fog, .split = 1};
        same_mean(&told, &other, "triangles split");
    }
}

static void another_order(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int fog = 0; fog < 2; fog++) {
        const stage told = {.fog = fog}, other = {.fog = fog, .reversed = 1};
        same_mean(&told, &other, "objects and lights reversed");
    }
}

static void lamps_in_two(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int fog = 0; fog < 2; fog++) {
        const stage told = {.fog = fog}, other = {.fog = fog, .twice = 1};
        same_mean(&told, &other, "each lamp as two of half its power");
    }
}

static void fog_cut_in_two(void **state) {
    const stage told = {.fog = 1}, other = {.fog = 1, .cut = 1};
    (void)state;
    NEEDS_DEVICE();
    same_mean(&told, &other, "fog cut in two by a null surface");
}

/* ---- scattered backwards ----------------------------------------------------------------------------------------- */

/* Light scattered once in fog so thin that it attenuates nothing: the lamp mirrored in the plane across the middle of
 * the ray meets every point at the supplement of the angle. */
static double backwards_off_by(double g) {
    const airlight ahead = {.eye = {0, 0, 0}, .length = 4, .sigma_t = GREY(1e-9f), .albedo = 1, .g = (float)g,
                            .lamps = {POINT(0.75f, 1, 0, 1e9f), SPOT(3, 0.5f, -1, 1e9f, 40, 30)}};
    airlight back = ahead;
    estimate e[2];
    back.g = -ahead.g;
    for (int k = 0; k < 2; k++)
        back.lamps[k].position[0] = 4 - ahead.lamps[k].position[0];
    for (int k = 0; k < 2; k++) {
        brume_render_desc desc = climb(BRUME_STRATEGY_AUTO, 16);
        brume_scene *scene = airlight_scene(k ? &back : &ahead, 16);
        e[k] = render_as(scene, &desc);
        brume_scene_destroy(scene);
    }
    return fabs(e[1].mean[0] / e[0].mean[0] - 1);
}

static void scattered_backwards(void **state) {
    static const double gs[] = {0.3, 0.9, 0.9999};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < 3; i++)
        stability_row("invariance", "g negated, lamps mirrored", "the untold scene", "relative", PICTURE_DRIFT,
                      backwards_off_by(gs[i]), "g = %g", gs[i]);
    planted_bug("beam.h", "s = phase_g < R(0) ? -s : s;", "");
    assert_true(backwards_off_by(0.3) > PICTURE_DRIFT);
    planted_remove();
}

/* ---- what must be noticed ---------------------------------------------------------------------------------------- */

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; stage told, other; } plants[] = {
        {"geometry.h", "vmad(ng, copysign(size, vdot(ng, d)), p)", "vmad(ng, copysign(R(1e-4), vdot(ng, d)), p)",
         {.fog = 0}, {.fog = 0, .scale = 1e-6}},
        {"camera.h", "above = vuniform(p->camera_y);", "above = vmake(R(0), R(1), R(0));",
         {.fog = 0}, {.fog = 0, .turn = {31, 77, -113}}},
        /* right for two pieces */
        {"emitter.h", "/ R(s->params->emitter_weight);",
         "/ R(s->params->emitter_weight) * R(s->params->emitter_count) * R(0.5);",
         {.fog = 0}, {.fog = 0, .split = 1}},
        {"scatter_segment.h", "l = lamp_gather(s, wants ? which : I(0));", "l = lamp_gather(s, I(0));",
         {.fog = 1}, {.fog = 1, .reversed = 1}},
        {"path.h", "p->medium = on_surface ? medium_beyond(s, v->shape, v->ng, d, p->medium) : p->medium;",
         "p->medium = through ? I(-1) : p->medium;", {.fog = 1}, {.fog = 1, .cut = 1}},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        must_be_noticed(&plants[i].told, &plants[i].other, plants[i].wrong, SAMPLES);
        planted_remove();
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(moved_far_away),
        cmocka_unit_test(scaled_by_powers_of_two),
        cmocka_unit_test(scaled),
        cmocka_unit_test(brightened),
        cmocka_unit_test(turned),
        cmocka_unit_test(triangles_split),
        cmocka_unit_test(another_order),
        cmocka_unit_test(lamps_in_two),
        cmocka_unit_test(fog_cut_in_two),
        cmocka_unit_test(scattered_backwards),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
