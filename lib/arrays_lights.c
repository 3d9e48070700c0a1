/* arrays_lights.c -- lights without extent, and emitting surfaces cut into pieces with the table they are chosen by. */
#include "arrays_build.h"

#include <math.h>
#include <stdlib.h>

#include "affine.h"

#define PI 3.14159265358979323846

static double versine(double angle) {
    double s = sin(0.5 * angle);
    return 2 * s * s;
}

/* Integral over the sphere of a falloff of 1 up to `beam`, then linear in the angle to 0 at `cutoff`: 2 pi (1 - (sin
 * cutoff - sin beam) / (cutoff - beam)), without the cancellation of narrow cones. */
static double spot_solid_angle(double cutoff, double beam) {
    double h = 0.5 * (cutoff - beam), m = 0.5 * (cutoff + beam);
    double rest = h > 0.01 ? 1 - sin(h) / h : h * h / 6 * (1 - h * h / 20 * (1 - h * h / 42));
    return 2 * PI * (versine(m) + cos(m) * rest);
}

static b_light make_light(const brume_light_desc *desc, const brume_arrays *arrays) {
    static const int kinds[] = {LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL};
    b_light out = {.kind = kinds[desc->kind], .texture = -1};
    double v[4][3];
    for (int i = 0; i < 4; i++)
        brume_affine_column(desc->to_world, i, v[i]);
    brume_arrays_place(arrays, v[3]);
    brume_store(v[3], out.position);
    if (desc->kind == BRUME_LIGHT_SPOT)
        brume_affine_axes(desc->to_world, v[0], v[1], v[2]);
    for (int i = 0; i < 3; i++)
        brume_normalize(v[i]);
    brume_store(v[0], out.frame_x);
    brume_store(v[1], out.frame_y);
    brume_store(v[2], out.axis);
    brume_arrays_store_light(arrays, desc->intensity, out.intensity);
    double cutoff = desc->cutoff_angle * (PI / 180), beam = desc->beam_width * (PI / 180);
    out.cutoff = (float)cutoff;
    out.beam = (float)beam;
    out.inv_fade = cutoff > beam ? (float)(1 / (cutoff - beam)) : 1e30f;
    out.v_cutoff = (float)versine(cutoff);
    out.v_beam = (float)versine(beam);
    /* Only a texture asks for it, and only narrower cones have one. */
    out.tan_cutoff = desc->cutoff_angle < 90 ? (float)tan(cutoff) : 0;
    out.solid_angle = (float)(desc->kind == BRUME_LIGHT_SPOT    ? spot_solid_angle(cutoff, beam)
                              : desc->kind == BRUME_LIGHT_POINT ? 4 * PI
                                                                : 0);
    if (desc->kind == BRUME_LIGHT_SPOT && desc->texture != BRUME_NONE)
        out.texture = (int)desc->texture;
    return out;
}

static brume_result delta_lights(const brume_scene *scene, brume_arrays *arrays) {
    BRUME_TRY(brume_arrays_alloc(scene, "lights", scene->light_count, sizeof(b_light), &arrays->lights));
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const brume_light_desc *desc = &scene->lights[i].desc;
        if (desc->kind == BRUME_LIGHT_CONSTANT || desc->kind == BRUME_LIGHT_ENVMAP)
            continue;
        arrays->lights[arrays->light_count++] = make_light(desc, arrays);
    }
    arrays->params.light_count = (int)arrays->light_count;
    return BRUME_OK;
}

static brume_result lamp_table(const brume_scene *scene, brume_arrays *arrays) {
    uint32_t first;
    double *power;
    if (arrays->light_count == 0)
        return BRUME_OK;
    BRUME_TRY(brume_arrays_more_cdf(scene, arrays, arrays->light_count + 1, &first));
    BRUME_TRY(brume_arrays_alloc(scene, "lights", arrays->light_count, sizeof *power, &power));
    for (uint32_t i = 0; i < arrays->light_count; i++)
        power[i] = brume_luminance(arrays->lights[i].intensity) * arrays->lights[i].solid_angle;
    brume_cumulate(power, arrays->light_count, arrays->cdf + first);
    free(power);
    arrays->params.lamp_cdf = (int)first;
    return BRUME_OK;
}

static double triangle_area(const brume_arrays *arrays, const b_triangle *triangle) {
    double p[3][3], n[3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            p[k][i] = arrays->positions[3 * (size_t)triangle->v[k] + i];
    for (int i = 0; i < 3; i++) {
        p[1][i] -= p[0][i];
        p[2][i] -= p[0][i];
    }
    brume_cross(p[1], p[2], n);
    return 0.5 * brume_normalize(n);
}

static double quadric_area(const b_quadric *quadric) {
    if (quadric->kind == QUADRIC_SPHERE)
        return 4 * PI * quadric->radius * (double)quadric->radius;
    double n[3], u[3] = {quadric->du[0], quadric->du[1], quadric->du[2]},
                 v[3] = {quadric->dv[0], quadric->dv[1], quadric->dv[2]};
    brume_cross(u, v, n);
    return PI * brume_normalize(n);
}

static void add_emitter(brume_arrays *arrays, double *weights, int kind, int prim, int shape, double area) {
    b_emitter emitter = {kind, prim, shape, (float)area};
    weights[arrays->emitter_count] = area * brume_luminance(arrays->shapes[shape].radiance);
    arrays->emitters[arrays->emitter_count++] = emitter;
}

static brume_result emitters(const brume_scene *scene, brume_arrays *arrays) {
    const int triangles = arrays->params.triangle_count, quadrics = arrays->params.quadric_count;
    size_t count = 0;
    for (int i = 0; i < triangles; i++)
        count += arrays->shapes[arrays->triangles[i].shape].emits;
    for (int i = 0; i < quadrics; i++)
        count += arrays->shapes[arrays->quadrics[i].shape].emits;
    if (count == 0)
        return BRUME_OK;
    uint32_t first;
    double *weights;
    BRUME_TRY(brume_arrays_alloc(scene, "emitters", count, sizeof(b_emitter), &arrays->emitters));
    BRUME_TRY(brume_arrays_more_cdf(scene, arrays, count + 1, &first));
    BRUME_TRY(brume_arrays_alloc(scene, "emitters", count, sizeof *weights, &weights));
    for (int i = 0; i < triangles; i++) {
        int shape = arrays->triangles[i].shape;
        if (arrays->shapes[shape].emits)
            add_emitter(arrays, weights, EMITTER_TRIANGLE, i, shape, triangle_area(arrays, &arrays->triangles[i]));
    }
    for (int i = 0; i < quadrics; i++) {
        const b_quadric *quadric = &arrays->quadrics[i];
        if (arrays->shapes[quadric->shape].emits)
            add_emitter(arrays, weights, quadric->kind == QUADRIC_SPHERE ? EMITTER_SPHERE : EMITTER_DISK,
                        triangles + i, quadric->shape, quadric_area(quadric));
    }
    arrays->params.emitter_weight = (float)brume_cumulate(weights, count, arrays->cdf + first);
    free(weights);
    arrays->params.emitter_cdf = (int)first;
    arrays->params.emitter_count = (int)arrays->emitter_count;
    return BRUME_OK;
}

static brume_result light_tree(const brume_scene *scene, brume_arrays *arrays) {
    b_params *p = &arrays->params;
    if (arrays->light_count < BRUME_LIGHT_TREE_LEAST_LEAF)
        return BRUME_OK;
    brume_light_tree *tree = &arrays->light_tree;
    BRUME_TRY(brume_light_tree_build(scene->context, arrays->lights, arrays->light_count, tree));
    if (tree->leaves == 0 || (tree->leaves > 1 && arrays->light_count < BRUME_LIGHT_TREE_LEAST)) {
        brume_light_tree_free(tree);
        return BRUME_OK;
    }
    p->light_tree_blocks = (int)tree->block_count;
    p->light_tree_lamps = (int)tree->placed;
    p->light_tree_scale = brume_light_tree_scale(tree);
    return BRUME_OK;
}

brume_result brume_arrays_lights(const brume_scene *scene, brume_arrays *arrays) {
    BRUME_TRY(delta_lights(scene, arrays));
    BRUME_TRY(light_tree(scene, arrays));
    BRUME_TRY(lamp_table(scene, arrays));
    return emitters(scene, arrays);
}
