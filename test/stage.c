/* stage.c -- see stage.h. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "stage.h"

typedef struct builder {
    const stage *told;
    brume_scene *scene;
    double scale, brightness;
    double turn[9];
    uint32_t fog, white, mirror, glass, null;
} builder;

/* ---- from the untold scene to the world ------------------------------------------------------------------------- */

static void multiply(const double a[9], const double b[9], double out[9]) {
    for (int i = 0; i < 9; i++)
        out[i] = a[i / 3 * 3] * b[i % 3] + a[i / 3 * 3 + 1] * b[3 + i % 3] + a[i / 3 * 3 + 2] * b[6 + i % 3];
}

static void rotation(const double degrees[3], double out[9]) {
    double total[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int axis = 0; axis < 3; axis++) {
        double c = cos(degrees[axis] * (PI / 180)), s = sin(degrees[axis] * (PI / 180)), next[9];
        int j = (axis + 1) % 3, k = (axis + 2) % 3;
        double one[9] = {0};
        one[4 * axis] = 1;
        one[4 * j] = one[4 * k] = c;
        one[3 * j + k] = -s;
        one[3 * k + j] = s;
        multiply(one, total, next);
        memcpy(total, next, sizeof total);
    }
    memcpy(out, total, sizeof total);
}

/* The world's map after `local` (3 x 4, rows); `rigid` leaves the scale to the place. */
static void place(const builder *b, const double local[12], int rigid, float m[16]) {
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) {
            double x = 0;
            for (int j = 0; j < 3; j++)
                x += b->turn[3 * i + j] * local[4 * j + k];
            m[4 * i + k] = (float)(x * (rigid && k < 3 ? 1 : b->scale) + (k == 3 ? b->told->move[i] : 0));
        }
    m[12] = m[13] = m[14] = 0;
    m[15] = 1;
}

/* Columns: sides and place. */
#define MAP(xx, xy, xz, yx, yy, yz, zx, zy, zz, x, y, z) {xx, yx, zx, x, xy, yy, zy, y, xz, yz, zz, z}
#define BOX(sx, sy, sz, x, y, z) MAP(sx, 0, 0, 0, sy, 0, 0, 0, sz, x, y, z)

/* ---- objects ---------------------------------------------------------------------------------------------------- */

static void add(const builder *b, brume_shape_kind kind, const double local[12], uint32_t bsdf, double radiance) {
    brume_shape_desc desc = brume_shape_desc_default(kind);
    place(b, local, 0, desc.to_world);
    desc.bsdf = bsdf;
    set_all(desc.radiance, radiance * b->brightness);
    must(brume_scene_add_shape(b->scene, &desc, NULL));
}

/* The square [-1, 1]^2 as n x n cells of two triangles, under the map. */
static void add_square(const builder *b, int n, const double local[12], uint32_t bsdf, double radiance) {
    enum { MOST = 8 };
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_MESH);
    float positions[3 * (MOST + 1) * (MOST + 1)];
    uint32_t triangles[6 * MOST * MOST], *t = triangles;
    assert_true(n <= MOST);
    place(b, local, 0, desc.to_world);
    for (int i = 0; i <= n; i++)
        for (int j = 0; j <= n; j++) {
            /* Uneven cells: were pieces chosen without regard to their area, it would show. */
            double u = (double)i / n, v = (double)j / n;
            float *p = positions + 3 * (i * (n + 1) + j);
            p[0] = (float)(2 * u * u * u - 1);
            p[1] = (float)(2 * v * v * v - 1);
            p[2] = 0;
            if (b->told->bake) {
                const float *m = desc.to_world;
                float q[3];
                for (int k = 0; k < 3; k++)
                    q[k] = (float)((double)m[4 * k] * p[0] + (double)m[4 * k + 1] * p[1] + (double)m[4 * k + 3]);
                memcpy(p, q, sizeof q);
            }
        }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            uint32_t a = (uint32_t)(i * (n + 1) + j), right = a + (uint32_t)n + 1;
            uint32_t two[6] = {a, right, right + 1, a, right + 1, a + 1};
            memcpy(t, two, sizeof two);
            t += 6;
        }
    if (b->told->bake)
        scale_and_move(desc.to_world, 1, 1, 1, 0, 0, 0);
    desc.positions = positions;
    desc.vertex_count = (uint32_t)((n + 1) * (n + 1));
    desc.triangles = triangles;
    desc.triangle_count = (uint32_t)(2 * n * n);
    desc.bsdf = bsdf;
    set_all(desc.radiance, radiance * b->brightness);
    must(brume_scene_add_shape(b->scene, &desc, NULL));
}

static void add_object(const builder *b, int number) {
    static const double floor_at[12] = MAP(5, 0, 0, 0, 0, -5, 0, 1, 0, 0, -2, 6);
    static const double back_at[12] = MAP(-6, 0, 0, 0, 6, 0, 0, 0, -1, 0, 0, 10);
    static const double cube_at[12] = MAP(0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8, 1.5, -0.75, 6);
    static const double ball_at[12] = BOX(0.75, 0.75, 0.75, -1.5, -0.5, 5);
    static const double disk_at[12] = MAP(0.5, 0, 0, 0, 0.3, 0.4, 0, -0.8, 0.6, 0.25, 0.5, 4);
    static const double lamp_at[12] = MAP(1, 0, 0, 0, 0, 1, 0, -1, 0, -0.5, 2.5, 5);
    static const double veil_at[12] = MAP(8, 0, 0.0625, 0, 8, 0, 0, 0, 1, 0, 0, 2.5);
    int split = b->told->split;
    switch (number) {
    case 0: add_square(b, split ? 7 : 1, floor_at, b->white, 0); break;
    case 1: add_square(b, split ? 5 : 1, back_at, b->white, 0); break;
    case 2: add(b, BRUME_SHAPE_CUBE, cube_at, b->mirror, 0); break;
    case 3: add(b, BRUME_SHAPE_SPHERE, ball_at, b->told->fog ? b->white : b->glass, 0); break;
    case 4: add(b, BRUME_SHAPE_DISK, disk_at, b->white, 0); break;
    case 5: if (!b->told->fog) add_square(b, split ? 8 : 1, lamp_at, BRUME_NONE, 2); break;
    case 6:
        if (b->told->cut) {
            brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
            place(b, veil_at, 0, desc.to_world);
            desc.bsdf = b->null;
            desc.interior = desc.exterior = b->fog;
            must(brume_scene_add_shape(b->scene, &desc, NULL));
        }
        break;
    }
}

/* `share` of the lamp's power. */
static void add_lamp(const builder *b, int number, double share) {
    static const double spot_at[12] = MAP(1, 0, 0, 0, 0.6, 0.8, 0, -0.8, 0.6, 0.5, 3, 2);
    static const double point_at[12] = BOX(1, 1, 1, -2.5, 1.25, 4);
    static const double other_at[12] = MAP(0, 0, -1, 0, 1, 0, 1, 0, 0, -3, 0.25, 6);
    const double power = share * b->brightness * b->scale * b->scale;
    brume_light_desc desc = brume_light_desc_default(number == 1   ? BRUME_LIGHT_POINT
                                                     : number == 3 ? BRUME_LIGHT_CONSTANT
                                                                   : BRUME_LIGHT_SPOT);
    place(b, number == 0 ? spot_at : number == 2 ? other_at : point_at, 1, desc.to_world);
    desc.intensity[0] = (float)(number == 3 ? 0.25 * b->brightness : 20 * power);
    desc.intensity[1] = desc.intensity[0] * (number == 1 ? 0.5f : 1);
    desc.intensity[2] = desc.intensity[0];
    if (number == 0)
        desc.cutoff_angle = 25;
    if (number == 2) {
        desc.cutoff_angle = 100;
        desc.beam_width = 60;
    }
    if (number == 3 ? !b->told->fog : (b->told->fog || number == 0))
        must(brume_scene_add_light(b->scene, &desc, NULL));
}

/* ---- the scene -------------------------------------------------------------------------------------------------- */

static void add_bsdfs(builder *b) {
    brume_bsdf_desc metal = brume_bsdf_desc_default(b->told->fog ? BRUME_BSDF_DIFFUSE : BRUME_BSDF_ROUGH_CONDUCTOR);
    brume_bsdf_desc glass = brume_bsdf_desc_default(BRUME_BSDF_DIELECTRIC);
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    b->white = add_diffuse(b->scene, 0.75);
    metal.alpha_u = 0.25f;
    metal.alpha_v = 0.125f;
    must(brume_scene_add_bsdf(b->scene, &metal, &b->mirror));
    if (!b->told->fog)
        must(brume_scene_add_bsdf(b->scene, &glass, &b->glass));
    if (b->told->cut)
        must(brume_scene_add_bsdf(b->scene, &null, &b->null));
}

brume_scene *stage_scene(const stage *told, uint32_t samples) {
    enum { OBJECTS = 7, LAMPS = 4 };
    static const double eye[12] = BOX(1, 1, 1, 0, 0, 0);
    builder b = {.told = told, .scene = new_scene(told->fog ? 4 : 5, samples), .fog = BRUME_NONE};
    brume_sensor_desc sensor = brume_sensor_desc_default();
    b.scale = told->scale > 0 ? told->scale : 1;
    b.brightness = told->brightness > 0 ? told->brightness : 1;
    rotation(told->turn, b.turn);
    if (told->fog)
        b.fog = add_medium(b.scene, 0.125 / b.scale * (told->sigma_factor > 0 ? told->sigma_factor : 1), 0.75, 0.5, 0);
    place(&b, eye, 1, sensor.to_world);
    sensor.fov = 60;
    sensor.near_clip = (float)(0.0078125 * b.scale);
    sensor.far_clip = (float)(1024 * b.scale);
    sensor.medium = b.fog;
    must(brume_scene_set_sensor(b.scene, &sensor));
    add_bsdfs(&b);
    for (int i = 0; i < OBJECTS; i++)
        add_object(&b, told->reversed ? OBJECTS - 1 - i : i);
    for (int i = 0; i < LAMPS; i++) {
        int number = told->reversed ? LAMPS - 1 - i : i, parts = told->twice && number < 3 ? 2 : 1;
        for (int k = 0; k < parts; k++)
            add_lamp(&b, number, 1.0 / parts);
    }
    return b.scene;
}
