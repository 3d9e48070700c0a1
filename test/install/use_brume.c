/* A program of a user's, compiled as C99, as C++98 and by CMake against an installed library (test/check_install.sh). A
 * sky of one radiance, and nothing else: every pixel is that radiance. */
#include <brume.h>
#include <stdio.h>

enum { SIZE = 4, PIXELS = SIZE * SIZE };

static brume_result describe(brume_scene *scene)
{
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_film_desc film = brume_film_desc_default();
    brume_integrator_desc integrator = brume_integrator_desc_default();
    brume_result result;
    for (int i = 0; i < 3; i++)
        sky.intensity[i] = 0.25f * (float)(i + 1);
    film.width = film.height = SIZE;
    film.rfilter = BRUME_RFILTER_BOX;
    integrator.sample_count = 1;
    result = brume_scene_add_light(scene, &sky, NULL);
    if (!result)
        result = brume_scene_set_sensor(scene, &sensor);
    if (!result)
        result = brume_scene_set_film(scene, &film);
    return result ? result : brume_scene_set_integrator(scene, &integrator);
}

int main(void)
{
    brume_context *context = NULL;
    brume_device *device = NULL;
    brume_scene *scene = NULL;
    brume_render *render = NULL;
    float rgb[3 * PIXELS];
    int wrong = 0;

    brume_result result = brume_context_create(&context);
    if (!result)
        result = brume_device_open(context, BRUME_DEVICE_ANY, &device);
    if (!result)
        result = brume_scene_create(context, &scene);
    if (!result)
        result = describe(scene);
    if (!result)
        result = brume_render_create(device, scene, NULL, &render);
    if (!result)
        result = brume_render_run(render, NULL, NULL);
    if (!result)
        result = brume_render_read(render, BRUME_CHANNEL_RADIANCE, rgb, 3 * PIXELS);
    if (result)
        fprintf(stderr, "use_brume: %s: %s\n", brume_result_name(result), context ? brume_context_message(context) : "");
    for (int i = 0; i < 3 * PIXELS && !result; i++)
        wrong += rgb[i] != 0.25f * (float)(i % 3 + 1);
    if (wrong)
        fprintf(stderr, "use_brume: %d of %d values are wrong\n", wrong, 3 * PIXELS);

    brume_render_destroy(render);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
    if (!result && !wrong)
        printf("brume " BRUME_VERSION "\n");
    return result || wrong ? 1 : 0;
}
