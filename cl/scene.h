/* scene.h -- the arrays of a scene as one bundle, and how a kernel receives them. */
#ifndef BRUME_SCENE_CL_H
#define BRUME_SCENE_CL_H

#include "features.h"
#include "lane.h"
#include "vec.h"
#include "traverse.h"

typedef struct {
    __global const b_params *params;
    geometry geometry;
    __global const b_triangle *triangles;
    __global const float *positions, *normals, *uvs;
    __global const b_shape *shapes;
    __global const b_bsdf *bsdfs;
    __global const b_texture *textures;
    __global const float *texels;
    __global const b_medium *media;
    __global const b_light *lights;
    __global const b_emitter *emitters;
    __global const float *cdf, *filter;
    __global const b_light_block *light_tree;
    __global uchar *plan;  /* of the whole film, or NULL; see shared.h */
    size_t plan_stride;    /* from lamp to lamp */
    ireal plan_slot;       /* of each lane's pixel */
    int is_pilot;          /* writes the plan; else reads it */
    int is_chosen;         /* renders pixels that were chosen for their error */
#ifdef TRACE
    __global b_trace_vertex *trace;
#endif
} scene;

/* The first parameters of every kernel that reads the scene; lib/render.c sets them in this order. */
#define SCENE_PARAMETERS                                                                                            \
    __global const b_params *params, __global const b_node *nodes, __global const b_triangle_block *blocks,         \
        __global const int *quadric_ids, __global const b_quadric *quadrics, __global const b_triangle *triangles,  \
        __global const float *positions, __global const float *normals, __global const float *uvs,                  \
        __global const b_shape *shapes, __global const b_bsdf *bsdfs, __global const b_texture *textures,           \
        __global const float *texels, __global const b_medium *media, __global const b_light *lights,               \
        __global const b_emitter *emitters, __global const float *cdf, __global const float *filter,   \
        __global const b_light_block *light_tree

/* To hand them on. */
#define SCENE_ARGUMENTS                                                                                              \
    params, nodes, blocks, quadric_ids, quadrics, triangles, positions, normals, uvs, shapes, bsdfs, textures,       \
        texels, media, lights, emitters, cdf, filter, light_tree

#define SCENE_FROM_PARAMETERS(s)                \
    scene s;                                    \
    s.params = params;                          \
    s.geometry.nodes = nodes;                   \
    s.geometry.blocks = blocks;                 \
    s.geometry.quadric_ids = quadric_ids;       \
    s.geometry.quadrics = quadrics;             \
    s.geometry.triangle_count = params->triangle_count; \
    s.triangles = triangles;                    \
    s.positions = positions;                    \
    s.normals = normals;                        \
    s.uvs = uvs;                                \
    s.shapes = shapes;                          \
    s.bsdfs = bsdfs;                            \
    s.textures = textures;                      \
    s.texels = texels;                          \
    s.media = media;                            \
    s.lights = lights;                          \
    s.emitters = emitters;                      \
    s.cdf = cdf;                                \
    s.filter = filter;                          \
    s.light_tree = light_tree;                  \
    s.plan = NULL;                              \
    s.plan_stride = 0;                          \
    s.plan_slot = I(0);                         \
    s.is_pilot = 0;                             \
    s.is_chosen = 0

/* Farther than anything in a scene, near enough that its square is finite in float. */
#define FAR_AWAY R(1e18)

#endif
