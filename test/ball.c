/* ball.c -- see ball.h. */
#include "ball.h"

#include "open_device.h"

brume_scene *ball_scene(brume_context *of, uint32_t width, uint32_t height) {
    brume_scene *scene;
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_light_desc lamp = brume_light_desc_default(BRUME_LIGHT_POINT);
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_film_desc film = brume_film_desc_default();
    ball.center[2] = 4;
    film.width = width;
    film.height = height;
    must(brume_scene_create(of, &scene));
    must(brume_scene_add_shape(scene, &ball, NULL));
    must(brume_scene_add_light(scene, &lamp, NULL));
    must(brume_scene_set_sensor(scene, &sensor));
    must(brume_scene_set_film(scene, &film));
    return scene;
}

static brume_result describe(brume_scene *scene, brume_light_kind kind, uint32_t width, uint32_t height) {
    uint32_t fog = BRUME_NONE;
    int is_sky = kind == BRUME_LIGHT_CONSTANT;
    brume_result result = BRUME_OK;
    brume_medium_desc medium = brume_medium_desc_default();
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_light_desc light = brume_light_desc_default(kind);
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_film_desc film = brume_film_desc_default();
    medium.sigma_t[0] = medium.sigma_t[1] = medium.sigma_t[2] = 0.2f;
    ball.center[2] = 4;
    light.to_world[7] = is_sky ? 0 : 2; /* above the camera */
    film.width = width;
    film.height = height;
    if (!is_sky) result = brume_scene_add_medium(scene, &medium, &fog);
    sensor.medium = fog;
    if (!result) result = brume_scene_add_shape(scene, &ball, NULL);
    if (!result) result = brume_scene_add_light(scene, &light, NULL);
    if (!result) result = brume_scene_set_sensor(scene, &sensor);
    return result ? result : brume_scene_set_film(scene, &film);
}

brume_result ball_in_fog(brume_context *of, brume_light_kind lamp, uint32_t width, uint32_t height,
                         brume_scene **out) {
    brume_scene *scene = NULL;
    brume_result result = brume_scene_create(of, &scene);
    if (!result) result = describe(scene, lamp, width, height);
    if (!result)
        *out = scene;
    else
        brume_scene_destroy(scene);
    return result;
}
