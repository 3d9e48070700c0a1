/* test_bsdf_furnace.c -- the white furnace of every surface: under a sky of radiance 1 it shows its directional albedo,
 * at most 1, and 1 where nothing is absorbed. From upright to 89.99 degrees, from roughness 1e-4 to 1, off samples and
 * off values.
 *
 * Smooth surfaces have two ways to go at most, which the least and the largest variate find: what they carry adds up to
 * what Fresnel's formulas in double let back and through. Refracted radiance counts times the index squared.
 *
 * Rough metal is held against an integral over its facets in double (facet_integral.h). Its values, at the directions
 * of that same lattice, may be off by rounding only. Means of samples may be off by what Bernstein's inequality allows
 * (1924), which holds where a few rare ones lose all of the light and a t-test fails: of n samples from 0 to b of known
 * variance v, the mean is off by more than e with a probability below 2 exp(-n e^2 / 2 (v + b e / 3)). All together
 * keep CONFIDENCE (stats.h). Samples of all facets have weights without bound, whose largest are cut in both.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "facet_integral.h"
#include "planted.h"
#include "stability.h"
#include "stats.h"

#define PI 3.14159265358979323846

static const double angles[] = {0, 10, 25, 40, 55, 65, 75, 82, 86, 89, 89.9, 89.99};
enum { ANGLES = sizeof angles / sizeof *angles };

/* Off by how much where, of what may be; `most` counts tolerances. */
typedef struct worst {
    double most;
    char where[128];
} worst;

static void note(worst *w, double error, double tolerance, const char *where) {
    double most = error / tolerance;
    if (most <= w->most) return; /* NaN goes on */
    w->most = most;
    snprintf(w->where, sizeof w->where, "%s", where);
}

/* ---- smooth surfaces, and diffuse ones --------------------------------------------------------------------------- */

enum { BACK = 1 };

/* Red is white throughout; BACK of a two-sided one is the surface after it. */
static size_t smooth_surfaces(b_bsdf *out, const char **names) {
    static const struct { int kind, flags, own_back; float ior, eta; const char *name; } table[] = {
        {BSDF_DIFFUSE, 0, 0, 1, 0, "diffuse"},
        {BSDF_DIFFUSE, BSDF_TWO_SIDED, 1, 1, 0, "diffuse on both sides"},
        {BSDF_DIFFUSE, BSDF_TWO_SIDED, 0, 1, 0, "diffuse before a mirror"},
        {BSDF_CONDUCTOR, 0, 0, 1, 0, "mirror"},
        {BSDF_CONDUCTOR, BSDF_TWO_SIDED, 1, 1, 0, "mirror on both sides"},
        {BSDF_CONDUCTOR, 0, 0, 1, 0.2f, "gold"},
        {BSDF_CONDUCTOR, 0, 0, 1, 1.5f, "aluminium"},
        {BSDF_DIELECTRIC, 0, 0, 1, 0, "dielectric of index 1"},
        {BSDF_DIELECTRIC, 0, 0, 1.0003f, 0, "dielectric of index 1.0003"},
        {BSDF_DIELECTRIC, 0, 0, 1.33f, 0, "water"},
        {BSDF_DIELECTRIC, 0, 0, 1.5f, 0, "glass"},
        {BSDF_DIELECTRIC, 0, 0, 2.42f, 0, "diamond"},
        {BSDF_DIELECTRIC, 0, 0, 0.66f, 0, "air in glass"},
        {BSDF_THIN_DIELECTRIC, 0, 0, 1, 0, "pane of index 1"},
        {BSDF_THIN_DIELECTRIC, 0, 0, 1.5f, 0, "pane of glass"},
        {BSDF_THIN_DIELECTRIC, 0, 0, 2.42f, 0, "pane of diamond"},
        {BSDF_NULL, 0, 0, 1, 0, "null"},
    };
    const size_t count = sizeof table / sizeof *table;
    for (size_t i = 0; i < count; i++) {
        b_bsdf b = white(table[i].kind);
        b.flags = table[i].flags;
        b.back = (int)i + !table[i].own_back;
        b.ior = table[i].ior;
        b.reflectance[1] = 0.5f, b.reflectance[2] = 0;
        b.transmittance[1] = 0.25f;
        for (int c = 0; c < 3; c++) {
            b.eta[c] = table[i].eta;
            b.k[c] = table[i].eta < 1 ? 3.9f : 7.6f;
        }
        out[i] = b;
        names[i] = table[i].name;
    }
    return count;
}

static double smooth_albedo(const b_bsdf *all, size_t id, double cosine, int channel) {
    const b_bsdf *b = &all[id];
    if (cosine < 0 && b->flags & BSDF_TWO_SIDED) {
        b = &all[b->back];
        cosine = -cosine;
    }
    double r = b->reflectance[channel], t = b->transmittance[channel], back;
    switch (b->kind) {
    case BSDF_DIFFUSE: return cosine > 0 ? r : 0;
    case BSDF_CONDUCTOR: return cosine > 0 ? r * twin_fresnel_conductor(cosine, b->eta[channel], b->k[channel]) : 0;
    case BSDF_DIELECTRIC: back = twin_fresnel_dielectric(cosine, b->ior); break;
    case BSDF_THIN_DIELECTRIC:
        back = twin_fresnel_dielectric(fabs(cosine), b->ior);
        back = 2 * back / (1 + back);
        break;
    default: return 1;
    }
    return r * back + t * (1 - back);
}

/* In order of surface, angle, side, end of the variates. */
static worst smooth_worst(brume_precision precision) {
    enum { MOST = 32, COUNT = MOST * ANGLES * 4 };
    static double wo[3 * COUNT], u[3 * COUNT];
    static uint32_t ids[COUNT];
    b_bsdf all[MOST];
    const char *names[MOST];
    size_t surfaces = smooth_surfaces(all, names);
    double tolerance = 8 * (precision == BRUME_PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON);
    worst w = {-1, ""};
    for (size_t i = 0; i < COUNT; i++) {
        direction o = rounded(polar(angles[i / 4 % ANGLES] * PI / 180, 0.7), precision);
        wo[i] = o.x, wo[COUNT + i] = o.y, wo[2 * COUNT + i] = i / 2 % 2 ? -o.z : o.z;
        u[i] = i % 2 ? 1 - 0x1p-24 : 0;
        u[COUNT + i] = 0.3, u[2 * COUNT + i] = 0.6;
        ids[i] = (uint32_t)(i / (4 * ANGLES) < surfaces ? i / (4 * ANGLES) : 0);
    }
    device_case c = {precision, 16, all, surfaces, ids, COUNT, wo};
    double *s = device_sample(&c, u);
    for (size_t i = 0; i < surfaces * ANGLES * 4; i += 2) {
        double z = wo[2 * COUNT + i];
        int one_way = s[DELTA * COUNT + i] == 0 || (s[WI_Z * COUNT + i] > 0) == (s[WI_Z * COUNT + i + 1] > 0);
        for (int channel = 0; channel < 3; channel++) {
            double sum = 0, expected = smooth_albedo(all, ids[i], z, channel);
            char where[128];
            for (size_t k = i; k < i + (one_way ? 1 : 2); k++) {
                double weight = s[(size_t)(WEIGHT_R + channel) * COUNT + k], eta = s[ETA * COUNT + k];
                sum += weight * eta * eta * (one_way ? 1 : s[PDF * COUNT + k]);
            }
            snprintf(where, sizeof where, "%s%s at %g degrees, channel %d: %.9g, not %.9g", names[ids[i]],
                     z < 0 ? " from behind" : "", angles[i / 4 % ANGLES], channel, sum, expected);
            note(&w, fabs(sum - expected), tolerance, where);
        }
    }
    free(s);
    return w;
}

/* f |cos| of diffuse ones, by a rule that is exact for it: 4 eighths of Gauss in z, evenly in phi, on both sides. */
static worst diffuse_values_worst(brume_precision precision) {
    enum { NODES = 32, TURNS = 4, COUNT = 2 * NODES * TURNS };
    static double wo[3 * COUNT], wi[3 * COUNT];
    static uint32_t ids[COUNT];
    b_bsdf all[32];
    const char *names[32];
    size_t surfaces = smooth_surfaces(all, names);
    double tolerance = 8 * (precision == BRUME_PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON), weights[NODES];
    worst w = {-1, ""};
    for (size_t id = 0; id < 2; id++)
        for (int a = 0; a < 2 * ANGLES; a++) {
            direction o = rounded(polar(angles[a / 2] * PI / 180, 0.7), precision);
            for (size_t i = 0; i < COUNT; i++) {
                double z = stats_gauss_node((int)i % NODES, NODES / 8, 1, &weights[i % NODES]);
                direction d = polar(acos(z), 2 * PI * (double)(i / NODES % TURNS) / TURNS);
                wi[i] = d.x, wi[COUNT + i] = d.y, wi[2 * COUNT + i] = i / (NODES * TURNS) ? -z : z;
                wo[i] = o.x, wo[COUNT + i] = o.y, wo[2 * COUNT + i] = a % 2 ? -o.z : o.z;
                ids[i] = (uint32_t)id;
            }
            device_case c = {precision, 16, all, surfaces, ids, COUNT, wo};
            double *f = device_eval(&c, wi), sum = 0, expected = smooth_albedo(all, id, a % 2 ? -o.z : o.z, 0);
            char where[128];
            for (size_t i = 0; i < COUNT; i++) sum += f[i] * weights[i % NODES] * 2 * PI / TURNS;
            snprintf(where, sizeof where, "%s%s at %g degrees: %.9g, not %.9g", names[id], a % 2 ? " from behind" : "",
                     angles[a / 2], sum, expected);
            note(&w, fabs(sum - expected), tolerance, where);
            free(f);
        }
    return w;
}

/* ---- rough metal ------------------------------------------------------------------------------------------------- */

#define LEAST 1.0001e-4 /* that isn't clamped */
static const double alphas[] = {LEAST, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 1};
enum { ALPHAS = sizeof alphas / sizeof *alphas };

static b_bsdf metal(int flags, int a, int anisotropic) {
    return mirror_and_gold(flags, alphas[a], anisotropic ? alphas[(a + ALPHAS / 2) % ALPHAS] : alphas[a]);
}

enum { GRID = 128, NODES = GRID * GRID };

/* Computed once for each surface and angle; what lattices of a quarter of the nodes say bounds their error. */
static moments kept[2][ALPHAS][2][ANGLES][2];
#define GRID_ERROR 3e-4

static void fill_kept(void) {
    double most = 0, largest = 0;
    for (int i = 0; i < 2 * ALPHAS * 2 * ANGLES; i++) {
        int beckmann = i % 2, anisotropic = i / 2 % 2, k = i / 4 % ANGLES, a = i / 4 / ANGLES;
        b_bsdf b = metal(beckmann ? BSDF_BECKMANN : 0, a, anisotropic);
        direction wo = rounded(polar(angles[k] * PI / 180, 0.7), BRUME_PRECISION_FLOAT);
        moments coarse[2], *fine = kept[beckmann][a][anisotropic][k];
        moments_of(&b, wo, GRID / 2, coarse);
        moments_of(&b, wo, GRID, fine);
        most = fmax(most, fmax(fabs(fine->visible - coarse->visible), fabs(fine->all - coarse->all)));
        largest = fmax(largest, fine->visible);
    }
    print_message("lattices of %d and %d differ by %.2g; the most is %.9g\n", GRID, GRID / 2, most, largest);
    assert_true(most < GRID_ERROR && largest <= 1 + 1e-12);
}

enum { SAMPLES = 1 << 14, METALS = 4 * ALPHAS * 2 * ANGLES * 2 };

static double may_be_off(double variance, double largest) {
    double l = log(2 * METALS / CONFIDENCE), linear = largest * l / (3 * SAMPLES);
    return GRID_ERROR + linear + sqrt(linear * linear + 2 * l * variance / SAMPLES);
}

/* Every other surface from behind, two-sided, where it has to be the same. */
static worst metal_samples_worst(int first_alpha, int last_alpha, int first_flags, int last_flags) {
    enum { COUNT = ANGLES * SAMPLES };
    static double wo[3 * COUNT], u[3 * COUNT];
    static uint32_t ids[COUNT];
    worst w = {-1, ""};
    uint64_t seed = 11;
    for (size_t i = 0; i < 3 * COUNT; i++) u[i] = test_random_unit(&seed);
    for (int i = first_alpha * 8; i < (last_alpha + 1) * 8; i++) {
        int flags = i % 4 * 2, anisotropic = i / 4 % 2, a = i / 8, behind = (a + anisotropic) % 2;
        if (flags < first_flags || flags > last_flags) continue;
        int all = flags & BSDF_SAMPLE_ALL;
        b_bsdf b = metal(flags | (behind ? BSDF_TWO_SIDED : 0), a, anisotropic);
        for (size_t n = 0; n < COUNT; n++) {
            direction o = polar(angles[n / SAMPLES] * PI / 180, 0.7);
            wo[n] = o.x, wo[COUNT + n] = o.y, wo[2 * COUNT + n] = behind ? -o.z : o.z;
        }
        device_case c = {BRUME_PRECISION_FLOAT, 16, &b, 1, ids, COUNT, wo};
        double *s = device_sample(&c, u);
        for (size_t k = 0; k < 2 * ANGLES; k++) {
            const moments *m = &kept[flags & BSDF_BECKMANN ? 1 : 0][a][anisotropic][k / 2][k % 2];
            const double *weight = s + (WEIGHT_R + k % 2) * COUNT + k / 2 * SAMPLES;
            double mean = 0, expected = all ? m->all : m->visible, most = 0;
            for (size_t n = 0; n < SAMPLES; n++) {
                most = fmax(most, weight[n]);
                mean += fmin(weight[n], MOST_WEIGHT) / SAMPLES;
            }
            double may = all ? may_be_off(m->all2 - m->all * m->all, MOST_WEIGHT)
                             : may_be_off(m->visible2 - m->visible * m->visible, 1);
            char where[128];
            snprintf(where, sizeof where, "flags %d alpha %g %g at %g degrees, channel %d: %.6f, not %.6f", b.flags,
                     b.alpha_u, b.alpha_v, angles[k / 2], (int)k % 2, mean, expected);
            note(&w, fabs(mean - expected), may, where);
            if (!all) note(&w, most - 1, 8 * FLT_EPSILON, where); /* no sample gains light */
        }
        free(s);
    }
    return w;
}

/* Each f over the twin's density of facets, in the mean over the grid. */
static worst metal_values_worst(brume_precision precision, double tolerance, int first_alpha, int last_alpha) {
    static double wo[3 * NODES], wi[3 * NODES], weights[NODES];
    static uint32_t ids[NODES];
    worst w = {-1, ""};
    for (int i = first_alpha * 4 * ANGLES; i < (last_alpha + 1) * 4 * ANGLES; i++) {
        int beckmann = i % 2, anisotropic = i / 2 % 2, k = i / 4 % ANGLES, a = i / 4 / ANGLES;
        b_bsdf b = metal(beckmann ? BSDF_BECKMANN : 0, a, anisotropic);
        direction o = rounded(polar(angles[k] * PI / 180, 0.7), BRUME_PRECISION_FLOAT);
        for (int n = 0; n < NODES; n++) {
            facet f = facet_of(&b, o, GRID, n / GRID, n % GRID);
            wo[n] = o.x, wo[NODES + n] = o.y, wo[2 * NODES + n] = o.z;
            wi[n] = f.wi.x, wi[NODES + n] = f.wi.y, wi[2 * NODES + n] = f.wi.z;
            weights[n] = 4 * f.weight * f.cosine / (f.m.z * twin_density(&b, f.m));
        }
        device_case c = {precision, 16, &b, 1, ids, NODES, wo};
        double *f = device_eval(&c, wi);
        for (int channel = 0; channel < 2; channel++) {
            double sum = 0, expected = kept[beckmann][a][anisotropic][k][channel].visible;
            char where[128];
            for (int n = 0; n < NODES; n++)
                if (weights[n] > 0) sum += weights[n] * f[channel * NODES + n];
            snprintf(where, sizeof where, "%s alpha %g %g at %g degrees, channel %d: %.9g, not %.9g",
                     beckmann ? "Beckmann" : "GGX", b.alpha_u, b.alpha_v, angles[k], channel, sum, expected);
            note(&w, fabs(sum / expected - 1), tolerance, where);
        }
        free(f);
    }
    return w;
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

#define VALUES_DOUBLE 1e-9 /* of gold's table, mostly */
#define VALUES_FLOAT 1e-4

static void report(const char *name, const char *reference, const char *unit, double tolerance,
                   const worst *w) {
    print_message("%s: %.3g, may be %.3g, %s\n", name, w->most * tolerance, tolerance, w->where);
    stability_row("furnace", name, reference, unit, tolerance, w->most * tolerance, "%s", w->where);
}

static int set_up(void **state) {
    fill_kept();
    return device_test_setup(state);
}

static void smooth_surfaces_keep_all_light(void **state) {
    (void)state;
    for (int p = 0; p < 2; p++) {
        brume_precision precision = p ? BRUME_PRECISION_DOUBLE : BRUME_PRECISION_FLOAT;
        if (!device_test_offers(precision)) skip();
        double epsilon = p ? DBL_EPSILON : FLT_EPSILON;
        worst w = smooth_worst(precision);
        report(p ? "albedo of smooth surfaces, in double" : "albedo of smooth surfaces",
               "Fresnel's formulas with complex indices in long double; 1 where white", "of 1", 8 * epsilon, &w);
        w = diffuse_values_worst(precision);
        report(p ? "albedo of diffuse surfaces by values, in double" : "albedo of diffuse surfaces by values", "1",
               "of 1", 8 * epsilon, &w);
    }
}

static void metal_by_samples(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    worst w = metal_samples_worst(0, ALPHAS - 1, 0, 6);
    report("albedo of rough metal by samples", "integral over its facets in double",
           "Bernstein's bounds", 1, &w);
}

static void metal_by_values(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    worst w = metal_values_worst(BRUME_PRECISION_FLOAT, VALUES_FLOAT, 4, ALPHAS - 1);
    report("albedo of rough metal by values, roughness 0.01 to 1", "integral over its facets in double", "relative",
           VALUES_FLOAT, &w);
    if (!device_test_offers(BRUME_PRECISION_DOUBLE)) skip();
    w = metal_values_worst(BRUME_PRECISION_DOUBLE, VALUES_DOUBLE, 0, ALPHAS - 1);
    report("albedo of rough metal by values, in double", "integral over its facets in double", "relative",
           VALUES_DOUBLE, &w);
}

static double smooth_most(void) { return smooth_worst(BRUME_PRECISION_FLOAT).most; }
static double diffuse_most(void) { return diffuse_values_worst(BRUME_PRECISION_FLOAT).most; }
static double samples_most(void) { return metal_samples_worst(9, 9, 0, 6).most; }
static double values_most(void) { return metal_values_worst(BRUME_PRECISION_FLOAT, VALUES_FLOAT, 9, 9).most; }

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; double (*most)(void); } plants[] = {
        {"bsdf_dielectric.h", "square(split.inverse_eta)", "split.inverse_eta", smooth_most},
        {"bsdf_thin_dielectric.h", "(R(1) - face) / (R(1) + face)", "square(R(1) - face)", smooth_most},
        {"bsdf_conductor.h", "fresnel_conductor_rgb(wo.z,", "fresnel_conductor_rgb(R(1),", smooth_most},
        {"bsdf.h", "s.wi = bsdf_side(b, s.wi);", "s.weight = cselect(b->mirrored, cgrey(R(0)), s.weight);",
         smooth_most},
        {"bsdf_diffuse.h", "above ? wi.z * R(1 / PI)", "above ? wi.z * R(0.3183)", diffuse_most},
        {"bsdf_rough_conductor.h", "s.wi.z / area_i * (sample_all", "(sample_all", samples_most},
        {"bsdf_rough_conductor.h", "cos_om / (area_o * m.z) : R(1)", "cos_om / area_o : R(1)", samples_most},
        {"bsdf_rough_conductor.h", "density * wi.z / (area_o * area_i)", "density / area_o", values_most},
    };
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (size_t i = 0; i < sizeof plants / sizeof *plants; i++) {
        device_test_teardown(NULL); /* what it has built */
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        assert_int_equal(device_test_setup(NULL), 0);
        double most = plants[i].most();
        planted_remove();
        print_message("%s: %.3g of what may be\n", plants[i].wrong, most);
        if (!(most > 1)) fail_msg("%s was not noticed", plants[i].wrong);
    }
    device_test_teardown(NULL);
    assert_int_equal(device_test_setup(NULL), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(smooth_surfaces_keep_all_light),
        cmocka_unit_test(metal_by_samples),
        cmocka_unit_test(metal_by_values),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, set_up, device_test_teardown);
}
