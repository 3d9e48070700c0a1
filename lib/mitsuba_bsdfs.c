/* mitsuba_bsdfs.c -- diffuse, dielectric, thindielectric, conductor, roughconductor, twosided, null. */
#include "mitsuba.h"

#include <string.h>

static void read_desc(mitsuba_reader *reader, xml_node *node, brume_bsdf_desc *out);

static void read_reflectance(mitsuba_object *o, const char *name, brume_bsdf_desc *desc) {
    mitsuba_rgb_or_texture(o, name, MITSUBA_REFLECTANCE, desc->reflectance, &desc->reflectance_texture);
}

/* A number or the name of a material. */
static void read_ior(mitsuba_object *o, const char *name, float *out) {
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p) return;
    if (strcmp(p->node->tag, "string") != 0) {
        *out = mitsuba_float(o, name, *out);
        mitsuba_require(o, name, *out > 0.0f, "be positive");
        return;
    }
    const char *material = xml_attribute_value(p->node, "value");
    if (mitsuba_dielectric(material, out)) return;
    const char *near = mitsuba_nearest_dielectric(material);
    if (near)
        mitsuba_fail(o->reader, p->node, "unknown dielectric '%s'; did you mean '%s'?", material, near);
    else
        mitsuba_fail(o->reader, p->node, "unknown dielectric '%s'", material);
}

static void read_dielectric(mitsuba_object *o, brume_bsdf_desc *desc) {
    read_ior(o, "int_ior", &desc->int_ior);
    read_ior(o, "ext_ior", &desc->ext_ior);
    read_reflectance(o, "specular_reflectance", desc);
    mitsuba_rgb(o, "specular_transmittance", MITSUBA_REFLECTANCE, desc->transmittance);
}

static void read_conductor(mitsuba_object *o, brume_bsdf_desc *desc) {
    const char *material = mitsuba_string(o, "material", NULL);
    int has_eta = mitsuba_rgb(o, "eta", MITSUBA_COEFFICIENT, desc->eta);
    int has_k = mitsuba_rgb(o, "k", MITSUBA_COEFFICIENT, desc->k);
    read_reflectance(o, "specular_reflectance", desc);
    if (!material) return;
    mitsuba_require(o, "material", !has_eta && !has_k, "not be given together with eta or k");
    if (o->reader->result != BRUME_OK || mitsuba_conductor(material, desc->eta, desc->k)) return;
    const mitsuba_property *p = mitsuba_find(o, "material");
    const char *near = mitsuba_nearest_conductor(material);
    if (near)
        mitsuba_fail(o->reader, p->node, "unknown conductor '%s'; did you mean '%s'?", material, near);
    else
        mitsuba_fail(o->reader, p->node, "unknown conductor '%s'", material);
}

static void read_roughness(mitsuba_object *o, brume_bsdf_desc *desc) {
    static const char *const names[] = {"alpha", "alpha_u", "alpha_v"};
    int there[3];
    for (int i = 0; i < 3; i++) {
        const mitsuba_property *p = mitsuba_find(o, names[i]);
        there[i] = p != NULL;
        if (p && p->object)
            mitsuba_fail(o->reader, p->node, "a <%s> for property '%s' of %s is not supported yet", p->object->tag,
                         names[i], o->type);
    }
    desc->alpha_u = mitsuba_float(o, there[1] ? "alpha_u" : "alpha", desc->alpha_u);
    desc->alpha_v = mitsuba_float(o, there[2] ? "alpha_v" : "alpha", desc->alpha_v);
    mitsuba_require(o, "alpha", !(there[0] && (there[1] || there[2])), "not be given together with alpha_u or alpha_v");
    mitsuba_require(o, there[1] ? "alpha_u" : "alpha_v", there[1] == there[2], "be given together with its sibling");
    mitsuba_require(o, there[1] ? "alpha_u" : "alpha", desc->alpha_u > 0.0f, "be positive");
    mitsuba_require(o, there[2] ? "alpha_v" : "alpha", desc->alpha_v > 0.0f, "be positive");

    const char *distribution = mitsuba_string(o, "distribution", "beckmann");
    int is_ggx = strcmp(distribution, "ggx") == 0 || strcmp(distribution, "GGX") == 0;
    mitsuba_require(o, "distribution", is_ggx || strcmp(distribution, "beckmann") == 0, "be beckmann or ggx");
    desc->distribution = is_ggx ? BRUME_DISTRIBUTION_GGX : BRUME_DISTRIBUTION_BECKMANN;
    desc->sample_visible = (uint32_t)mitsuba_boolean(o, "sample_visible", 1);
}

/* One side seen from both, or a second one for the back. */
static void read_twosided(mitsuba_object *o, brume_bsdf_desc *desc) {
    const mitsuba_property *sides[2];
    for (int i = 0; i < 2; i++) {
        sides[i] = mitsuba_child(o, "bsdf");
        if (!sides[i]) continue;
        xml_node *side = sides[i]->object;
        const char *type = xml_attribute_value(side, "type");
        if (type && (!strcmp(type, "dielectric") || !strcmp(type, "thindielectric") || !strcmp(type, "null") ||
                     !strcmp(type, "twosided")))
            mitsuba_fail(o->reader, sides[i]->node, "a twosided can't hold a %s", type);
    }
    if (!sides[0]) {
        mitsuba_fail(o->reader, o->node, "a twosided needs a <bsdf>");
        return;
    }
    if (mitsuba_child(o, "bsdf")) mitsuba_fail(o->reader, o->node, "a twosided has at most two sides");
    if (o->reader->result != BRUME_OK) return;
    read_desc(o->reader, sides[0]->object, desc);
    desc->two_sided = 1;
    if (sides[1]) desc->back = mitsuba_read_bsdf(o->reader, sides[1]->object);
}

static void read_desc(mitsuba_reader *reader, xml_node *node, brume_bsdf_desc *out) {
    mitsuba_object o = mitsuba_open(reader, node);
    if (mitsuba_is(&o, "dielectric")) {
        *out = brume_bsdf_desc_default(BRUME_BSDF_DIELECTRIC);
        read_dielectric(&o, out);
    } else if (mitsuba_is(&o, "thindielectric")) {
        *out = brume_bsdf_desc_default(BRUME_BSDF_THIN_DIELECTRIC);
        read_dielectric(&o, out);
    } else if (mitsuba_is(&o, "conductor")) {
        *out = brume_bsdf_desc_default(BRUME_BSDF_CONDUCTOR);
        read_conductor(&o, out);
    } else if (mitsuba_is(&o, "roughconductor")) {
        *out = brume_bsdf_desc_default(BRUME_BSDF_ROUGH_CONDUCTOR);
        read_conductor(&o, out);
        read_roughness(&o, out);
    } else if (mitsuba_is(&o, "null")) {
        *out = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    } else if (mitsuba_is(&o, "twosided")) {
        read_twosided(&o, out);
    } else {
        *out = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
        read_reflectance(&o, "reflectance", out);
    }
    mitsuba_close(&o);
}

uint32_t mitsuba_read_bsdf(mitsuba_reader *reader, xml_node *node) {
    if (!mitsuba_begin(reader, node)) return node->id;
    brume_bsdf_desc desc = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    read_desc(reader, node, &desc);
    uint32_t id = BRUME_NONE;
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_add_bsdf(reader->scene, &desc, &id));
    mitsuba_note(reader, node, BRUME_OBJECT_BSDF, id);
    mitsuba_end(node, id);
    return id;
}
