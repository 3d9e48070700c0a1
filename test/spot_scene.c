/* spot_scene.c -- see spot_scene.h. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "spot_scene.h"

static void translate(float m[16], float x, float y, float z) {
    const float t[16] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1};
    memcpy(m, t, sizeof t);
}

/* Scaled by s, turned so that the object's +z points along +y, moved. */
static void lay_flat(float m[16], float s, float x, float y, float z) {
    const float t[16] = {s, 0, 0, x, 0, 0, s, y, 0, -s, 0, z, 0, 0, 0, 1};
    memcpy(m, t, sizeof t);
}

brume_scene *spot_scene(brume_context *owner, unsigned parts) {
    brume_scene *scene;
    must(brume_scene_create(owner, &scene));
    uint32_t id, fog = BRUME_NONE, matt, glass, null;

    if (parts & PART_FOG) {
        brume_medium_desc m = brume_medium_desc_default();
        const float sigma[3] = {0.10f, 0.12f, 0.15f};
        memcpy(m.sigma_t, sigma, sizeof sigma);
        m.g = 0.4f;
        must(brume_scene_add_medium(scene, &m, &fog));
    }
    brume_bsdf_desc b = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    must(brume_scene_add_bsdf(scene, &b, &matt));
    brume_shape_desc floor_desc = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    lay_flat(floor_desc.to_world, 10, 0, -1, 0);
    floor_desc.bsdf = matt;
    must(brume_scene_add_shape(scene, &floor_desc, &id));

    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    ball.bsdf = matt;
    if (parts & PART_GLASS) {
        b = brume_bsdf_desc_default(BRUME_BSDF_DIELECTRIC);
        must(brume_scene_add_bsdf(scene, &b, &glass));
        ball.bsdf = glass;
        ball.exterior = fog;
    }
    must(brume_scene_add_shape(scene, &ball, &id));

    if (parts & PART_CLOUD) {
        brume_medium_desc m = brume_medium_desc_default();
        uint32_t cloud;
        m.g = -0.3f;
        m.emission[0] = 0.1f;
        must(brume_scene_add_medium(scene, &m, &cloud));
        b = brume_bsdf_desc_default(BRUME_BSDF_NULL);
        must(brume_scene_add_bsdf(scene, &b, &null));
        brume_shape_desc box = brume_shape_desc_default(BRUME_SHAPE_CUBE);
        translate(box.to_world, 2.2f, 0.1f, 0);
        box.bsdf = null;
        box.interior = cloud;
        box.exterior = fog;
        must(brume_scene_add_shape(scene, &box, &id));
    }
    if (parts & PART_AREA) {
        brume_shape_desc lamp = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
        lay_flat(lamp.to_world, 0.5f, -2, 3, 0);
        lamp.to_world[6] = -lamp.to_world[6]; /* facing down */
        lamp.to_world[9] = -lamp.to_world[9];
        lamp.radiance[0] = lamp.radiance[1] = lamp.radiance[2] = 4;
        must(brume_scene_add_shape(scene, &lamp, &id));
    }
    if (parts & PART_SKY) {
        brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
        sky.intensity[0] = 0.2f;
        must(brume_scene_add_light(scene, &sky, &id));
    }
    brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
    const float down[16] = {1, 0, 0, 0.5f, 0, 0, -1, 4, 0, 1, 0, 0, 0, 0, 0, 1};
    memcpy(spot.to_world, down, sizeof down);
    spot.intensity[0] = spot.intensity[1] = spot.intensity[2] = 30;
    must(brume_scene_add_light(scene, &spot, &id));

    brume_sensor_desc sensor = brume_sensor_desc_default();
    translate(sensor.to_world, 0, 0.5f, -6);
    sensor.fov = 60;
    sensor.medium = fog;
    must(brume_scene_set_sensor(scene, &sensor));
    brume_film_desc film = brume_film_desc_default();
    film.width = WIDTH;
    film.height = HEIGHT;
    must(brume_scene_set_film(scene, &film));
    brume_integrator_desc integrator = brume_integrator_desc_default();
    integrator.max_depth = 6;
    integrator.sample_count = 8;
    must(brume_scene_set_integrator(scene, &integrator));
    return scene;
}

void spot_render(const brume_scene *scene, const brume_render_desc *desc, float *radiance) {
    brume_render *render;
    brume_render_stats stats;
    must(brume_render_create(device, scene, desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, PIXELS * 3));
    must(brume_render_get_stats(render, &stats));
    assert_int_equal(stats.bad_samples, 0);
    assert_int_equal(stats.complete, 1);
    assert_int_equal(stats.samples, (uint64_t)PIXELS * stats.sample_count);
    brume_render_destroy(render);
}

double spot_mean(const float *x, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        assert_true(isfinite(x[i]));
        sum += x[i];
    }
    return sum / (double)count;
}
