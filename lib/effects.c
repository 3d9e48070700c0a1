/* effects.c -- what a scene calls for, and which object calls for it.
 *
 * Everything is decided from the description: what no shape and no sensor uses doesn't count, nor does a medium that
 * neither absorbs, scatters nor glows.
 */
#include "effects.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "light_tree.h"

typedef struct finding {
    const brume_scene *scene;
    uint32_t set;
    brume_effect_report *reports; /* or NULL */
} finding;

static void found(finding *f, brume_effect effect, brume_object object, uint32_t index, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

static void found(finding *f, brume_effect effect, brume_object object, uint32_t index, const char *format, ...) {
    f->set |= 1u << effect;
    if (!f->reports) return;
    brume_effect_report *r = &f->reports[effect];
    r->present = 1;
    if (r->count++) return;
    r->object = object;
    r->index = index;
    const brume_scene_origin *origin = brume_scene_origin_of(f->scene, object, index);
    if (origin) {
        snprintf(r->id, sizeof r->id, "%s", origin->id ? origin->id : "");
        /* The end of a long path says more than its beginning. */
        size_t length = strlen(origin->file), room = sizeof r->where - 16;
        snprintf(r->where, sizeof r->where, "%s:%u", origin->file + (length > room ? length - room : 0),
                 (unsigned)origin->line);
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(r->why, sizeof r->why, format, arguments);
    va_end(arguments);
}

/* ---- media ------------------------------------------------------------------------------------------------------- */

static int any(const float v[3]) {
    return v[0] > 0 || v[1] > 0 || v[2] > 0;
}

static int does_something(const brume_scene *scene, uint32_t id) {
    return id != BRUME_NONE && !scene->integrator.ignore_media &&
           (any(scene->media[id].sigma_t) || any(scene->media[id].emission));
}

/* Whether the sensor or a shape has it. */
static int is_used(const brume_scene *scene, uint32_t id) {
    if (scene->has_sensor && scene->sensor.medium == id) return 1;
    for (uint32_t i = 0; i < scene->shape_count; i++)
        if (scene->shapes[i].desc.interior == id || scene->shapes[i].desc.exterior == id) return 1;
    return 0;
}

static void find_in_medium(finding *f, uint32_t i) {
    const brume_medium_desc *m = &f->scene->media[i];
    const brume_integrator_desc *integrator = &f->scene->integrator;
    int absorbs = 0, scatters = 0, edges = integrator->max_depth < 0 ? INT32_MAX : integrator->max_depth;
    for (int c = 0; c < 3; c++) {
        absorbs |= m->sigma_t[c] > 0 && m->albedo[c] < 1;
        scatters |= m->sigma_t[c] > 0 && m->albedo[c] > 0;
    }
    found(f, BRUME_EFFECT_MEDIA, BRUME_OBJECT_MEDIUM, i, "sigma_t %g, %g, %g", m->sigma_t[0], m->sigma_t[1],
          m->sigma_t[2]);
    if (absorbs)
        found(f, BRUME_EFFECT_ABSORPTION, BRUME_OBJECT_MEDIUM, i, "albedo %g, %g, %g", m->albedo[0], m->albedo[1],
              m->albedo[2]);
    if (any(m->emission))
        found(f, BRUME_EFFECT_EMISSION, BRUME_OBJECT_MEDIUM, i, "emission %g, %g, %g", m->emission[0], m->emission[1],
              m->emission[2]);
    if (m->sigma_t[0] != m->sigma_t[1] || m->sigma_t[0] != m->sigma_t[2])
        found(f, BRUME_EFFECT_CHROMATIC_EXTINCTION, BRUME_OBJECT_MEDIUM, i, "sigma_t %g, %g, %g", m->sigma_t[0],
              m->sigma_t[1], m->sigma_t[2]);
    if (!scatters || edges < 2) return;
    found(f, BRUME_EFFECT_SCATTERING, BRUME_OBJECT_MEDIUM, i, "albedo %g, %g, %g", m->albedo[0], m->albedo[1],
          m->albedo[2]);
    if (m->g != 0) found(f, BRUME_EFFECT_ANISOTROPY, BRUME_OBJECT_MEDIUM, i, "g %g", m->g);
    if (edges < 3 || integrator->single_scattering) return;
    if (edges == INT32_MAX)
        found(f, BRUME_EFFECT_MULTIPLE_SCATTERING, BRUME_OBJECT_INTEGRATOR, 0, "max_depth has no limit");
    else
        found(f, BRUME_EFFECT_MULTIPLE_SCATTERING, BRUME_OBJECT_INTEGRATOR, 0, "max_depth %d", edges);
}

static void find_media(finding *f) {
    const brume_scene *s = f->scene;
    for (uint32_t i = 0; i < s->medium_count; i++)
        if (does_something(s, i) && is_used(s, i)) find_in_medium(f, i);
    for (uint32_t i = 0; i < s->shape_count; i++) {
        const brume_shape_desc *d = &s->shapes[i].desc;
        int inside = does_something(s, d->interior), outside = does_something(s, d->exterior);
        if (inside || outside)
            found(f, BRUME_EFFECT_BOUNDED_MEDIA, BRUME_OBJECT_SHAPE, i, "%s",
                  inside && outside ? "media on both sides" : inside ? "a medium behind it" : "a medium before it");
    }
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

static const char *shape_kind(brume_shape_kind kind) {
    return kind == BRUME_SHAPE_SPHERE ? "a sphere" : kind == BRUME_SHAPE_DISK ? "a disk" : "a mesh";
}

static void find_in_bsdf(finding *f, uint32_t i, uint32_t shape) {
    static const struct { brume_effect effect; const char *why; } kinds[] = {
        [BRUME_BSDF_DIFFUSE] = {BRUME_EFFECT_DIFFUSE, "reflects evenly"},
        [BRUME_BSDF_DIELECTRIC] = {BRUME_EFFECT_DIELECTRIC, "refracts"},
        [BRUME_BSDF_CONDUCTOR] = {BRUME_EFFECT_CONDUCTOR, "smooth metal"},
        [BRUME_BSDF_ROUGH_CONDUCTOR] = {BRUME_EFFECT_ROUGH_CONDUCTOR, "rough metal"},
        [BRUME_BSDF_NULL] = {BRUME_EFFECT_NULL_SURFACES, "invisible"},
        [BRUME_BSDF_THIN_DIELECTRIC] = {BRUME_EFFECT_DIELECTRIC, "a thin pane"},
    };
    const brume_bsdf_desc *d = &f->scene->bsdfs[i];
    found(f, kinds[d->kind].effect, BRUME_OBJECT_BSDF, i, "%s, on shape %u", kinds[d->kind].why, (unsigned)shape);
    if (d->reflectance_texture != BRUME_NONE && d->kind != BRUME_BSDF_NULL)
        found(f, BRUME_EFFECT_TEXTURES, BRUME_OBJECT_TEXTURE, d->reflectance_texture, "on bsdf %u", (unsigned)i);
}

static void find_surfaces(finding *f) {
    const brume_scene *s = f->scene;
    for (uint32_t i = 0; i < s->shape_count; i++) {
        const brume_shape_desc *d = &s->shapes[i].desc;
        if (any(d->radiance))
            found(f, BRUME_EFFECT_AREA_LIGHTS, BRUME_OBJECT_SHAPE, i, "radiance %g, %g, %g", d->radiance[0],
                  d->radiance[1], d->radiance[2]);
        if (d->kind != BRUME_SHAPE_MESH)
            found(f, BRUME_EFFECT_QUADRICS, BRUME_OBJECT_SHAPE, i, "%s", shape_kind(d->kind));
        if (d->bsdf == BRUME_NONE) {
            found(f, BRUME_EFFECT_DIFFUSE, BRUME_OBJECT_SHAPE, i, "names no bsdf");
            continue;
        }
        find_in_bsdf(f, d->bsdf, i);
        const brume_bsdf_desc *b = &s->bsdfs[d->bsdf];
        if (b->two_sided && b->back != BRUME_NONE && b->back != d->bsdf) find_in_bsdf(f, b->back, i);
    }
}

/* ---- lights ------------------------------------------------------------------------------------------------------ */

/* Environments that give no light are none. */
static int is_dark(const brume_scene_light *light) {
    const brume_light_desc *d = &light->desc;
    if (d->kind == BRUME_LIGHT_CONSTANT) return !any(d->intensity);
    if (d->kind != BRUME_LIGHT_ENVMAP) return 0;
    for (size_t i = 0; i < 3 * (size_t)d->width * d->height && d->scale > 0; i++)
        if (light->texels[i] > 0) return 0;
    return 1;
}

static void find_lights(finding *f) {
    static const brume_effect kinds[] = {
        [BRUME_LIGHT_POINT] = BRUME_EFFECT_POINT_LIGHTS,
        [BRUME_LIGHT_SPOT] = BRUME_EFFECT_SPOT_LIGHTS,
        [BRUME_LIGHT_DIRECTIONAL] = BRUME_EFFECT_DIRECTIONAL_LIGHTS,
        [BRUME_LIGHT_CONSTANT] = BRUME_EFFECT_ENVIRONMENT,
        [BRUME_LIGHT_ENVMAP] = BRUME_EFFECT_ENVIRONMENT,
    };
    const brume_scene *s = f->scene;
    uint32_t lamps = 0;
    for (uint32_t i = 0; i < s->light_count; i++) {
        const brume_light_desc *d = &s->lights[i].desc;
        int is_map = d->kind == BRUME_LIGHT_ENVMAP;
        if (is_dark(&s->lights[i])) continue;
        if (is_map)
            found(f, kinds[d->kind], BRUME_OBJECT_LIGHT, i, "a map");
        else
            found(f, kinds[d->kind], BRUME_OBJECT_LIGHT, i, "%s %g, %g, %g",
                  d->kind == BRUME_LIGHT_CONSTANT      ? "radiance"
                  : d->kind == BRUME_LIGHT_DIRECTIONAL ? "irradiance"
                                                       : "intensity",
                  d->intensity[0], d->intensity[1], d->intensity[2]);
        if (is_map)
            found(f, BRUME_EFFECT_ENVIRONMENT_MAP, BRUME_OBJECT_LIGHT, i, "%u x %u texels", (unsigned)d->width,
                  (unsigned)d->height);
        if (d->kind == BRUME_LIGHT_SPOT && d->texture != BRUME_NONE)
            found(f, BRUME_EFFECT_TEXTURES, BRUME_OBJECT_TEXTURE, d->texture, "gobo of light %u", (unsigned)i);
        lamps += !is_map && d->kind != BRUME_LIGHT_CONSTANT;
        if (lamps == BRUME_LIGHT_TREE_LEAST_LEAF && !(f->set & EFFECT(MANY_LIGHTS)))
            found(f, BRUME_EFFECT_MANY_LIGHTS, BRUME_OBJECT_LIGHT, i, "the %uth lamp without extent", (unsigned)lamps);
    }
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

uint32_t brume_effects_find(const brume_scene *scene, brume_effect_report *reports) {
    finding f = {scene, 0, reports};
    if (reports) memset(reports, 0, BRUME_EFFECT_COUNT * sizeof *reports);
    find_media(&f);
    find_surfaces(&f);
    find_lights(&f);
    if (f.set & EFFECT(SCATTERING)) {
        uint32_t shape, lamp;
        uint32_t count = brume_beams_meet(scene, &shape, &lamp);
        if (count) found(&f, BRUME_EFFECT_BEAM_SHADOWS, BRUME_OBJECT_SHAPE, shape, "in the light of light %u",
                         (unsigned)lamp);
        if (count && reports) reports[BRUME_EFFECT_BEAM_SHADOWS].count = count;
    }
    if (scene->has_sensor && scene->sensor.aperture_radius > 0)
        found(&f, BRUME_EFFECT_LENS, BRUME_OBJECT_SENSOR, 0, "aperture_radius %g", scene->sensor.aperture_radius);
    return f.set;
}

brume_result brume_scene_effects(const brume_scene *scene, uint32_t without, uint32_t *out_effects,
                                 brume_effect_report out_reports[BRUME_EFFECT_COUNT]) {
    if (!scene || !out_effects)
        return brume_fail(scene ? scene->context : NULL, BRUME_ERROR_ARGUMENT, "brume_scene_effects: NULL argument");
    brume_scene_view view;
    BRUME_TRY(brume_scene_view_make(scene, without, &view));
    uint32_t before = brume_effects_find(scene, NULL), after = brume_effects_find(&view.scene, out_reports);
    for (int i = 0; i < BRUME_EFFECT_COUNT && out_reports; i++)
        out_reports[i].taken_away = (before & ~after) >> i & 1;
    brume_scene_view_free(&view);
    *out_effects = after;
    return BRUME_OK;
}
