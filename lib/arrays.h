/* arrays.h -- from the scene description to the arrays the kernels read (cl/shared.h). Pure host code, no OpenCL. */
#ifndef BRUME_ARRAYS_H
#define BRUME_ARRAYS_H

#include "bvh.h"
#include "light_tree.h"
#include "scene.h"

typedef struct brume_arrays {
    b_params params;
    double origin[3];      /* in the scene's coordinates; positions below count from it */
    double light_unit;     /* a power of two: all light below is over it, and so is the film's */
    uint32_t features;     /* what the scene calls for, FEATURE_... */
    brume_bvh bvh;
    b_triangle *triangles; /* those dropped for having no area are not here */
    b_quadric *quadrics;
    float *positions, *normals, *uvs; /* the axes are the world's; 3, 3 and 2 floats */
    b_shape *shapes;
    b_bsdf *bsdfs;
    b_texture *textures;
    float *texels;         /* RGB triples: bitmaps, then the environment map */
    b_medium *media;
    b_light *lights;
    brume_light_tree light_tree; /* none where lamps are few */
    b_emitter *emitters;
    float *cdf;            /* emitters, then the environment's */
    float *filter;         /* inverse cumulative of the reconstruction filter, see cl/filter.h */
    uint32_t position_count, normal_count, uv_count; /* vertices */
    uint32_t shape_count, bsdf_count, texture_count, texel_count /* triples */, medium_count, light_count;
    uint32_t emitter_count, cdf_count, filter_count;
    uint32_t dropped_triangles;
    double bvh_seconds;
} brume_arrays;

/* `crop` {x, y, width, height} overrides the film's unless NULL. */
brume_result brume_arrays_build(const brume_scene *scene, const uint32_t crop[4], brume_arrays *out);
void brume_arrays_free(brume_arrays *arrays);

#endif
