/* arrays_build.h -- the steps of brume_arrays_build, each filling its part of brume_arrays. Private to lib/arrays*.c.
 *
 * What a step allocates it leaves in `arrays`, also where it fails: brume_arrays_build frees it.
 */
#ifndef BRUME_ARRAYS_BUILD_H
#define BRUME_ARRAYS_BUILD_H

#include "arrays.h"

/* origin: first of all, since all that has a place counts from it. */
void brume_arrays_choose_origin(const brume_scene *scene, brume_arrays *arrays);
/* From the scene's coordinates to those from there. */
void brume_arrays_place(const brume_arrays *arrays, double p[3]);

/* light_unit: before all that shines. */
void brume_arrays_choose_light_unit(const brume_scene *scene, brume_arrays *arrays);
/* Light of the scene in that unit. */
void brume_arrays_store_light(const brume_arrays *arrays, const float rgb[3], float out[3]);

/* shapes, positions, normals, uvs, triangles, quadrics, dropped_triangles; scene_center and scene_radius. Shapes that
 * name no bsdf are left with -1. */
brume_result brume_arrays_geometry(const brume_scene *scene, brume_arrays *arrays);

/* bsdfs, and those of the shapes that name none; textures and their texels. */
brume_result brume_arrays_surfaces(const brume_scene *scene, brume_arrays *arrays);

/* media, the sensor's too. */
brume_result brume_arrays_media(const brume_scene *scene, brume_arrays *arrays);

/* lights and their tree, emitters and their part of cdf. After geometry. */
brume_result brume_arrays_lights(const brume_scene *scene, brume_arrays *arrays);

/* lights[].medium: what each stands in. After media, lights and the hierarchy; where there are no null surfaces nobody
 * asks for it. */
void brume_arrays_lamp_media(brume_arrays *arrays);

/* The environment's radiance, or its texels and its part of cdf. After surfaces and lights. */
brume_result brume_arrays_environment(const brume_scene *scene, brume_arrays *arrays);

/* The camera, the film's size and crop, and the reconstruction filter. */
brume_result brume_arrays_camera(const brume_scene *scene, const uint32_t crop[4], brume_arrays *arrays);
brume_result brume_arrays_filter(const brume_scene *scene, brume_arrays *arrays);

/* ---- arrays_memory.c ---- */

/* Zeroed; `what` names the array in the message. A count of 0 gives NULL and success. */
brume_result brume_arrays_alloc(const brume_scene *scene, const char *what, size_t count, size_t size,
                                void *out_pointer);
/* Room for `count` more triples of texels, or entries of cdf: *out_first is where they start. */
brume_result brume_arrays_more_texels(const brume_scene *scene, brume_arrays *arrays, size_t count,
                                      uint32_t *out_first);
brume_result brume_arrays_more_cdf(const brume_scene *scene, brume_arrays *arrays, size_t count, uint32_t *out_first);

/* Of linear RGB, Rec. 709: the weights of cl/vec.h. */
double brume_luminance(const float rgb[3]);

/* weights[count] -> cdf[count + 1] from 0 to exactly 1, increasing only where a weight is positive. Returns their sum;
 * where it is 0, all are taken as equal. */
double brume_cumulate(const double *weights, size_t count, float *cdf);

#endif
