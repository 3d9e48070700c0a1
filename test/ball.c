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
