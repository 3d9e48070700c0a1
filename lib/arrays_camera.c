/* arrays_camera.c -- the camera's frame, field of view and lens, and the film's size and crop. */
#include "arrays_build.h"

#include <math.h>

#include "affine.h"

#define PI 3.14159265358979323846

/* Half extents of the image plane at distance 1, for square pixels. */
static void field_of_view(const brume_sensor_desc *sensor, double width, double height, b_params *p) {
    double half = tan(sensor->fov * (PI / 360)), along = width;
    switch (sensor->fov_axis) {
    case BRUME_FOV_X: along = width; break;
    case BRUME_FOV_Y: along = height; break;
    case BRUME_FOV_DIAGONAL: along = sqrt(width * width + height * height); break;
    case BRUME_FOV_SMALLER: along = fmin(width, height); break;
    case BRUME_FOV_LARGER: along = fmax(width, height); break;
    }
    p->tan_x = (float)(half * width / along);
    p->tan_y = (float)(half * height / along);
}

static brume_result place_crop(const brume_scene *scene, const uint32_t crop[4], b_params *p) {
    const brume_film_desc *film = &scene->film;
    uint32_t x = crop ? crop[0] : film->crop_x, y = crop ? crop[1] : film->crop_y;
    uint32_t width = crop ? crop[2] : film->crop_width, height = crop ? crop[3] : film->crop_height;
    if (x >= film->width || y >= film->height || width > film->width - x || height > film->height - y)
        return brume_fail(scene->context, BRUME_ERROR_ARGUMENT,
                          "the crop of %u x %u at (%u, %u) leaves the film of %u x %u", (unsigned)width,
                          (unsigned)height, (unsigned)x, (unsigned)y, (unsigned)film->width, (unsigned)film->height);
    p->width = (int)film->width;
    p->height = (int)film->height;
    p->crop_x = (int)x;
    p->crop_y = (int)y;
    p->crop_width = (int)(width ? width : film->width - x);
    p->crop_height = (int)(height ? height : film->height - y);
    return BRUME_OK;
}

brume_result brume_arrays_camera(const brume_scene *scene, const uint32_t crop[4], brume_arrays *arrays) {
    const brume_sensor_desc *sensor = &scene->sensor;
    b_params *p = &arrays->params;
    double x[3], y[3], z[3], origin[3];
    brume_affine_axes(sensor->to_world, x, y, z);
    brume_affine_column(sensor->to_world, 3, origin);
    brume_arrays_place(arrays, origin);
    brume_store(x, p->camera_x);
    brume_store(y, p->camera_y);
    brume_store(z, p->camera_z);
    brume_store(origin, p->camera_o);
    field_of_view(sensor, scene->film.width, scene->film.height, p);
    p->near_clip = sensor->near_clip;
    p->far_clip = sensor->far_clip;
    p->aperture_radius = sensor->aperture_radius;
    p->focus_distance = sensor->focus_distance;
    p->sensor_medium = sensor->medium == BRUME_NONE || scene->integrator.ignore_media ? -1 : (int)sensor->medium;
    return place_crop(scene, crop, p);
}
