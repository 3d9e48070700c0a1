/* test_wedge_leaks.c -- the walk of cl/traverse_wedge.h through closed meshes: from inside to outside not one position
 * may be lit, those exactly behind edges and vertices included.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "stability.h"
#include "wedge_batch.h"

static double symmetric(uint64_t *seed) { return 2 * test_uniform(seed) - 1; }

/* Lamp in the mesh, ray outside, or the other way about: nothing is lit. */
static void make_inside_out(uint64_t seed, int on_grid, int lamp_outside, double scale, double shift) {
    for (int i = 0; i < WEDGES; i++) {
        double inner[3], outer[3], d[3], r2 = 0, along = 0, length = 0;
        int axis = i % 3, j = (axis + 1) % 3, k = (axis + 2) % 3;
        for (int a = 0; a < 3; a++) {
            inner[a] = 0.4 * symmetric(&seed);
            outer[a] = symmetric(&seed);
            d[a] = symmetric(&seed);
            r2 += d[a] * d[a];
        }
        for (int a = 0; a < 3; a++) along += outer[a] * d[a] / r2;
        for (int a = 0; a < 3; a++) outer[a] -= along * d[a], length += outer[a] * outer[a];
        /* outside: the line passes the middle at more than the mesh's 1.2, or the cube's diagonal of 1.73 */
        double away = 1.8 + test_uniform(&seed), back = 2 * symmetric(&seed);
        for (int a = 0; a < 3; a++) {
            d[a] /= sqrt(r2);
            outer[a] = outer[a] * away / sqrt(length) - back * d[a];
        }
        if (on_grid) { /* all of it on the corners' own planes, so that planes, edges and vertices fall together */
            for (int a = 0; a < 3; a++) {
                inner[a] = floor(inner[a] * 8) / 8;
                d[a] = 0;
            }
            d[axis] = i & 1 ? 1 : -1;
            outer[axis] = -2 * d[axis];
            outer[j] = inner[j];
            outer[k] = i & 2 ? -1.5 : 1.5;
            if (i & 4) outer[j] += outer[k] - inner[k]; /* a diagonal plane */
        }
        double *lamp = lamp_outside ? outer : inner, *o = lamp_outside ? inner : outer;
        for (int a = 0; a < 3; a++) {
            wedge_in[a][i] = (float)(scale * lamp[a] + shift);
            wedge_in[3 + a][i] = (float)(scale * o[a] + shift);
            wedge_in[6 + a][i] = d[a];
        }
        wedge_in[9][i] = lamp_outside ? 0.1 * scale : i % 5 ? 5 * scale * test_uniform(&seed) : 1e18;
        wedge_in[10][i] = test_random_unit(&seed);
        wedge_in[11][i] = 0;
    }
}

typedef struct leaks { int lit, positions; } leaks;

/* Surfaces nearer to the lamp than a millionth of the way count as its own, for shadow rays as for wedges: positions
 * that far out are not looked at. */
static void count_lit(const char *text, const test_mesh *m, int ends, leaks *c) {
    wedge_compute(text, "", 16, ends, m);
    for (int i = 0; i < WEDGES; i++)
        for (int j = 0; j < wedge_out[COUNT][i] && wedge_is_planar(i); j++) {
            if (fabs(wedge_positions[j][i]) > 1e5 * wedge_scene_radius) continue;
            c->positions++;
            c->lit += !wedge_dark_at(i, j);
        }
}

/* kind: a bumpy sphere, or a cube whose planes, edges and vertices lamp and ray share. */
static leaks count_leaks(const char *text, int kind, double scale, double shift) {
    leaks c = {0, 0};
    test_mesh m = kind ? test_mesh_cube(16) : test_mesh_sphere(48, 64, 0.2);
    for (uint32_t i = 0; i < 3 * m.vertex_count; i++) m.positions[i] = (float)(scale * m.positions[i] + shift);
    wedge_scene_radius = 2 * scale;
    for (int outside = 0; outside < 2; outside++) {
        make_inside_out(91, kind, outside, scale, shift);
        for (int ends = 0; ends < 2; ends++) count_lit(text, &m, ends, &c);
    }
    wedge_scene_radius = 2;
    test_mesh_free(&m);
    return c;
}

static void closed_meshes_let_nothing_through(void **state) {
    static const double where[][2] = {{1, 0}, {1, 10000}, {1e-4, 0}, {1e4, 0}};
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int k = 0; k < 4; k++)
        for (int kind = 0; kind < 2; kind++) {
            leaks c = count_leaks(wedge_text, kind, where[k][0], where[k][1]);
            stability_row("hazard", kind ? "lamp and ray in the planes of a closed cube" :
                          "lamp and ray on two sides of a closed sphere", "all is dark", "positions lit", 0, c.lit,
                          "of %d; size %g at %g", c.positions, where[k][0], where[k][1]);
            assert_true(c.positions > 500000);
        }
}

static void wrong_walks_leak(void **state) {
    static const struct { const char *from, *to; int kind; } bugs[] = {
        /* ranges open at both ends */
        {"(t >= (wide)low) & (t < (wide)high)", "(t > (wide)low) & (t < (wide)high)", 0},
        /* an edge's two triangles interpolate from different ends */
        {"wide_mask a_below = za < (wide)0;", "wide_mask a_below = za == za;", 0},
        /* a vertex in the plane is on one side as the first of its triangle, on the other else */
        {"n0 = z[0] < (wide)0,", "n0 = z[0] <= (wide)0,", 1},
        /* a range that begins at the last position still open is not looked at */
        {"            w.t1 = whole->t1;\n", "\n", 0},
    };
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        const char *text = device_test_plant("traverse_wedge.h", bugs[i].from, bugs[i].to, wedge_text);
        assert_true(count_leaks(text, bugs[i].kind, 1, 0).lit > 100);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_meshes_let_nothing_through),
        cmocka_unit_test(wrong_walks_leak),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}
