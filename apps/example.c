/* example -- the library in two pages: a scene built by calls alone, rendered, and written to a picture.
 *
 *     build/example [fog.png]
 *
 * A spotlight shines through fog onto a ball that lies on a floor. Compile such a program with
 *     cc example.c -lbrume
 */
#include <math.h>
#include <stdio.h>

#include "brume.h"

/* The matrix (row-major) that puts its owner at `from` and points its +z at `to`, with +y upwards if possible. */
static void look_at(float matrix[16], const float from[3], const float to[3])
{
    float z[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    float length = sqrtf(z[0] * z[0] + z[1] * z[1] + z[2] * z[2]);
    for (int i = 0; i < 3; i++)
        z[i] /= length;
    /* x = (0, 1, 0) cross z, y = z cross x */
    float flat = sqrtf(z[0] * z[0] + z[2] * z[2]);
    float x[3] = {z[2] / flat, 0, -z[0] / flat};
    float y[3] = {z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]};
    for (int i = 0; i < 3; i++) {
        matrix[4 * i] = x[i];
        matrix[4 * i + 1] = y[i];
        matrix[4 * i + 2] = z[i];
        matrix[4 * i + 3] = from[i];
        matrix[12 + i] = 0;
    }
    matrix[15] = 1;
}

static void set3(float out[3], float a, float b, float c)
{
    out[0] = a;
    out[1] = b;
    out[2] = c;
}

/* The scene. Every call that can fail says so; the first failure is passed on. */
static brume_result describe(brume_scene *scene)
{
    brume_result result;
    uint32_t fog, white, red;

    /* Fog: a mean free path of 1 / 0.12 units; nine tenths of what it takes from a ray it scatters, rather forwards. */
    brume_medium_desc medium = brume_medium_desc_default();
    set3(medium.sigma_t, 0.12f, 0.12f, 0.12f);
    set3(medium.albedo, 0.9f, 0.9f, 0.9f);
    medium.g = 0.3f;
    if ((result = brume_scene_add_medium(scene, &medium, &fog)))
        return result;

    /* The camera stands in it, and nothing ends it: the fog is everywhere. */
    brume_sensor_desc sensor = brume_sensor_desc_default();
    look_at(sensor.to_world, (const float[3]){0, 1.6f, 6}, (const float[3]){0, 1, 0});
    sensor.fov = 45;
    sensor.medium = fog;
    if ((result = brume_scene_set_sensor(scene, &sensor)))
        return result;

    brume_film_desc film = brume_film_desc_default();
    film.width = 480;
    film.height = 320;
    if ((result = brume_scene_set_film(scene, &film)))
        return result;

    brume_integrator_desc integrator = brume_integrator_desc_default();
    integrator.sample_count = 32;
    if ((result = brume_scene_set_integrator(scene, &integrator)))
        return result;

    /* A spotlight, up on the left; its cone is 9 degrees from axis to edge. */
    brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
    look_at(spot.to_world, (const float[3]){-3, 3, 0.5f}, (const float[3]){0.6f, 0.6f, 0});
    set3(spot.intensity, 220, 200, 160);
    spot.cutoff_angle = 9;
    if ((result = brume_scene_add_light(scene, &spot, NULL)))
        return result;

    brume_bsdf_desc diffuse = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    set3(diffuse.reflectance, 0.4f, 0.4f, 0.4f);
    if ((result = brume_scene_add_bsdf(scene, &diffuse, &white)))
        return result;
    set3(diffuse.reflectance, 0.7f, 0.2f, 0.15f);
    if ((result = brume_scene_add_bsdf(scene, &diffuse, &red)))
        return result;

    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    set3(ball.center, 0.6f, 0.6f, 0);
    ball.radius = 0.6f;
    ball.bsdf = red;
    if ((result = brume_scene_add_shape(scene, &ball, NULL)))
        return result;

    /* A rectangle lies in z = 0 and faces +z; turned about x, it is a floor that faces +y. */
    brume_shape_desc ground = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    const float turned[16] = {40, 0, 0, 0, 0, 0, 40, 0, 0, -40, 0, 0, 0, 0, 0, 1};
    for (int i = 0; i < 16; i++)
        ground.to_world[i] = turned[i];
    ground.bsdf = white;
    return brume_scene_add_shape(scene, &ground, NULL);
}

int main(int argc, char **argv)
{
    const char *path = argc > 1 ? argv[1] : "example.png";
    brume_context *context = NULL;
    brume_device *device = NULL;
    brume_scene *scene = NULL;
    brume_render *render = NULL;

    brume_result result = brume_context_create(&context);
    if (!result)
        result = brume_device_open(context, BRUME_DEVICE_ANY, &device);
    if (!result)
        result = brume_scene_create(context, &scene);
    if (!result)
        result = describe(scene);
    if (!result) {
        brume_render_desc desc = brume_render_desc_default();
        result = brume_render_create(device, scene, &desc, &render);
    }
    if (!result)
        result = brume_render_run(render, NULL, NULL);
    if (!result) {
        brume_picture_desc picture = brume_picture_desc_default();
        picture.exposure = 1;
        result = brume_render_write(render, path, &picture);
    }
    if (result)
        fprintf(stderr, "example: %s: %s\n", brume_result_name(result), context ? brume_context_message(context) : "");
    else
        printf("%s\n", path);

    brume_render_destroy(render);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return result ? 1 : 0;
}
