/* mitsuba_media.c -- homogeneous media and their phase functions. `emission` (radiance per scene unit) is our own.
 *
 * Any sigma_t >= 0 is taken. Mitsuba 3's RGB mode treats sigma_t as a reflectance: it refuses RGB and clamps spectra
 * above 1, so that a file for both says what exceeds 1 by `scale`.
 */
#include "mitsuba.h"

#include <float.h>

void mitsuba_read_phase(mitsuba_reader *reader, xml_node *node, float *out_g) {
    mitsuba_object o = mitsuba_open(reader, node);
    float g = 0.0f;
    if (mitsuba_is(&o, "hg")) {
        g = mitsuba_float(&o, "g", 0.8);
        mitsuba_require(&o, "g", g > -1.0f && g < 1.0f, "be in (-1, 1)");
    }
    mitsuba_close(&o);
    if (reader->result != BRUME_OK) return;
    *out_g = g;
    node->mark = XML_READ;
}

uint32_t mitsuba_read_medium(mitsuba_reader *reader, xml_node *node) {
    if (!mitsuba_begin(reader, node)) return node->id;
    brume_medium_desc desc = brume_medium_desc_default();
    mitsuba_object o = mitsuba_open(reader, node);
    mitsuba_rgb(&o, "sigma_t", MITSUBA_COEFFICIENT, desc.sigma_t);
    mitsuba_rgb(&o, "albedo", MITSUBA_REFLECTANCE, desc.albedo);
    mitsuba_rgb(&o, "emission", MITSUBA_EMISSION, desc.emission);
    float scale = mitsuba_float(&o, "scale", 1.0);
    mitsuba_require(&o, "scale", scale >= 0.0f, "not be negative");
    for (int i = 0; i < 3; i++) {
        desc.sigma_t[i] *= scale;
        mitsuba_require(&o, "scale", desc.sigma_t[i] <= FLT_MAX, "be smaller: sigma_t overflows");
    }
    const mitsuba_property *phase = mitsuba_child(&o, "phase");
    if (phase) mitsuba_read_phase(reader, phase->object, &desc.g);
    if (mitsuba_child(&o, "phase")) mitsuba_fail(reader, node, "a medium has at most one <phase>");
    /* How Mitsuba samples; the picture's mean does not depend on them. */
    mitsuba_boolean(&o, "sample_emitters", 1);
    mitsuba_boolean(&o, "has_spectral_extinction", 1);
    mitsuba_close(&o);
    uint32_t id = BRUME_NONE;
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_add_medium(reader->scene, &desc, &id));
    mitsuba_note(reader, node, BRUME_OBJECT_MEDIUM, id);
    reader->has_media = 1;
    mitsuba_end(node, id);
    return id;
}

uint32_t mitsuba_read_endpoint_medium(mitsuba_object *o) {
    const mitsuba_property *medium = mitsuba_child(o, "medium");
    if (!medium) return BRUME_NONE;
    if (mitsuba_child(o, "medium")) mitsuba_fail(o->reader, o->node, "%s has at most one <medium>", o->type);
    return mitsuba_read_medium(o->reader, medium->object);
}
