/* known_answer.c -- see known_answer.h. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "known_answer.h"

/* ---- scenes by a few words --------------------------------------------------------------------------------------- */

const view along_z = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, NARROW};

/* x = up x forward: with +z forward and +y up, +x is to the left. */
void view_matrix(const view *v, float m[16]) {
    double x[3], y[3], z[3], length = 0;
    for (int i = 0; i < 3; i++)
        length += v->forward[i] * v->forward[i];
    for (int i = 0; i < 3; i++)
        z[i] = v->forward[i] / sqrt(length);
    length = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        x[i] = v->up[j] * z[k] - v->up[k] * z[j];
        length += x[i] * x[i];
    }
    for (int i = 0; i < 3; i++)
        x[i] /= sqrt(length);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        y[i] = z[j] * x[k] - z[k] * x[j];
    }
    for (int i = 0; i < 3; i++) {
        m[4 * i] = (float)x[i];
        m[4 * i + 1] = (float)y[i];
        m[4 * i + 2] = (float)z[i];
        m[4 * i + 3] = (float)v->origin[i];
    }
    m[12] = m[13] = m[14] = 0;
    m[15] = 1;
}

void scale_and_move(float m[16], double sx, double sy, double sz, double x, double y, double z) {
    memset(m, 0, 16 * sizeof m[0]);
    m[0] = (float)sx;
    m[5] = (float)sy;
    m[10] = (float)sz;
    m[3] = (float)x;
    m[7] = (float)y;
    m[11] = (float)z;
    m[15] = 1;
}

void set_all(float rgb[3], double value) {
    rgb[0] = rgb[1] = rgb[2] = (float)value;
}

brume_scene *new_scene(int max_depth, uint32_t samples) {
    brume_scene *scene = NULL;
    brume_film_desc film = brume_film_desc_default();
    brume_integrator_desc integrator = brume_integrator_desc_default();
    must(brume_scene_create(context, &scene));
    film.width = film.height = PIXELS;
    film.rfilter = BRUME_RFILTER_BOX;
    must(brume_scene_set_film(scene, &film));
    integrator.max_depth = max_depth;
    integrator.sampler = BRUME_SAMPLER_INDEPENDENT;
    integrator.sample_count = samples;
    integrator.seed = 7;
    must(brume_scene_set_integrator(scene, &integrator));
    return scene;
}

void set_camera(brume_scene *scene, const view *v, uint32_t medium) {
    brume_sensor_desc sensor = brume_sensor_desc_default();
    view_matrix(v, sensor.to_world);
    sensor.fov = v->fov;
    sensor.near_clip = 1e-12f; /* fog before it is not seen: at an optical depth of 100 a millionth would tell */
    sensor.far_clip = 1e6f;
    sensor.medium = medium;
    must(brume_scene_set_sensor(scene, &sensor));
}

uint32_t add_medium(brume_scene *scene, double sigma_t, double albedo, double g, double emission) {
    uint32_t id = BRUME_NONE;
    brume_medium_desc desc = brume_medium_desc_default();
    set_all(desc.sigma_t, sigma_t);
    set_all(desc.albedo, albedo);
    set_all(desc.emission, emission);
    desc.g = (float)g;
    must(brume_scene_add_medium(scene, &desc, &id));
    return id;
}

uint32_t add_diffuse(brume_scene *scene, double reflectance) {
    uint32_t id = BRUME_NONE;
    brume_bsdf_desc desc = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    set_all(desc.reflectance, reflectance);
    desc.two_sided = 1;
    must(brume_scene_add_bsdf(scene, &desc, &id));
    return id;
}

void add_wall(brume_scene *scene, double z, double half_size, double reflectance) {
    uint32_t id;
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    scale_and_move(desc.to_world, half_size, half_size, 1, 0, 0, z);
    desc.bsdf = add_diffuse(scene, reflectance);
    must(brume_scene_add_shape(scene, &desc, &id));
}

void add_null_box(brume_scene *scene, uint32_t medium, double half_x, double half_y, double z0, double z1) {
    uint32_t id;
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    must(brume_scene_add_bsdf(scene, &null, &desc.bsdf));
    scale_and_move(desc.to_world, half_x, half_y, (z1 - z0) / 2, 0, 0, (z0 + z1) / 2);
    desc.interior = medium;
    desc.is_boundary = 1;
    must(brume_scene_add_shape(scene, &desc, &id));
}

void add_point(brume_scene *scene, double x, double y, double z) {
    uint32_t id;
    brume_light_desc desc = brume_light_desc_default(BRUME_LIGHT_POINT);
    scale_and_move(desc.to_world, 1, 1, 1, x, y, z);
    must(brume_scene_add_light(scene, &desc, &id));
}

void add_spot(brume_scene *scene, const view *v, double intensity, double cutoff, double beam) {
    uint32_t id;
    brume_light_desc desc = brume_light_desc_default(BRUME_LIGHT_SPOT);
    view_matrix(v, desc.to_world);
    set_all(desc.intensity, intensity);
    desc.cutoff_angle = (float)cutoff;
    desc.beam_width = (float)beam;
    must(brume_scene_add_light(scene, &desc, &id));
}

void add_constant(brume_scene *scene, double radiance) {
    uint32_t id;
    brume_light_desc desc = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
    set_all(desc.intensity, radiance);
    must(brume_scene_add_light(scene, &desc, &id));
}

/* ---- estimates and checks ---------------------------------------------------------------------------------------- */

void render_pixels(const brume_scene *scene, const brume_render_desc *desc, float *pixels) {
    brume_render *picture = NULL;
    brume_render_stats stats;
    must(brume_render_create(device, scene, desc, &picture));
    must(brume_render_run(picture, NULL, NULL));
    must(brume_render_read(picture, BRUME_CHANNEL_RADIANCE, pixels, PIXELS * PIXELS * 3));
    must(brume_render_get_stats(picture, &stats));
    assert_int_equal(stats.bad_samples, 0);
    brume_render_destroy(picture);
}

estimate estimate_of(const float *pixels) {
    estimate result;
    const int n = PIXELS * PIXELS;
    for (int c = 0; c < 3; c++) {
        double sum = 0, squares = 0;
        for (int i = 0; i < n; i++)
            sum += pixels[3 * i + c];
        for (int i = 0; i < n; i++)
            squares += (pixels[3 * i + c] - sum / n) * (pixels[3 * i + c] - sum / n);
        result.mean[c] = sum / n;
        result.error[c] = sqrt(squares / (n - 1.0) / n);
    }
    return result;
}

double estimate_off(const char *what, estimate e, double expected) {
    double off = fabs(e.mean[0] - expected) / e.error[0];
    print_message("%s: %.6g, expected %.6g: %+.2f %%, standard error %.2f %%, %.1f of them\n", what, e.mean[0], expected,
                  100 * (e.mean[0] / expected - 1), 100 * e.error[0] / expected, off);
    return off;
}

estimate render_as(const brume_scene *scene, const brume_render_desc *desc) {
    float pixels[PIXELS * PIXELS * 3];
    render_pixels(scene, desc, pixels);
    return estimate_of(pixels);
}

brume_render_desc climb(brume_strategy strategy, uint32_t samples) {
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0;
    desc.use_strategy = 1;
    desc.strategy = strategy;
    desc.sample_count = samples;
    return desc;
}

brume_render_desc climb_by_rays(brume_strategy strategy, uint32_t samples) {
    brume_render_desc desc = climb(strategy, samples);
    desc.use_indirect = 1;
    desc.indirect = BRUME_INDIRECT_RAY_LIGHTS;
    desc.lanes = 8;
    return desc;
}

estimate render(brume_scene *scene) {
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0;
    estimate result = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return result;
}

double errors_off(double mean, double error, double expected) {
    double beyond = fabs(mean - expected) - FLOAT_ERROR * fabs(expected);
    return beyond <= 0 ? 0 : beyond / error; /* NaN stays */
}

int agrees(double mean, double error, double expected) { return errors_off(mean, error, expected) <= ERRORS_ALLOWED; }

void check(const char *name, const estimate *e, int channel, double expected, double precision) {
    double mean = e->mean[channel], error = e->error[channel];
    print_message("%-52s %.8g expected %.8g: %+.2e, standard error %.1e\n", name, mean, expected,
                  mean / expected - 1, error / expected);
    if (!agrees(mean, error, expected))
        fail_msg("%s is %.9g (standard error %.2g), not %.9g", name, mean, error, expected);
    if (!(error <= precision * fabs(expected)))
        fail_msg("%s: a standard error of %.2g in %.9g says too little", name, error, expected);
}
