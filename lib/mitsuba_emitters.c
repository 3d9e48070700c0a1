/* mitsuba_emitters.c -- point, spot, directional, constant, envmap; area inside shapes.
 *
 * An emitter's medium is the one its light starts in. Paths are built from the camera and know the medium they are in,
 * so it is read, to be checked, and then has no effect: as in Mitsuba's own volpath.
 */
#include "mitsuba.h"

#include <stdlib.h>
#include <string.h>

/* What every emitter has. */
static void read_common(mitsuba_object *o) {
    mitsuba_read_endpoint_medium(o);
    if (mitsuba_float(o, "sampling_weight", 1.0) != 1.0f)
        mitsuba_warn(o->reader, o->node, "sampling_weight is ignored; it changes noise only");
}

static void translation(const double position[3], float out[16]) {
    for (int i = 0; i < 16; i++) out[i] = i % 5 == 0 ? 1.0f : 0.0f;
    for (int i = 0; i < 3; i++) out[4 * i + 3] = (float)position[i];
}

static void read_point(mitsuba_object *o, brume_light_desc *desc) {
    double position[3];
    int has_transform = mitsuba_to_world(o, desc->to_world);
    if (mitsuba_vector(o, "position", position)) {
        mitsuba_require(o, "position", !has_transform, "not be given together with to_world");
        translation(position, desc->to_world);
    }
    mitsuba_rgb(o, "intensity", MITSUBA_EMISSION, desc->intensity);
}

static void read_spot(mitsuba_object *o, brume_light_desc *desc) {
    mitsuba_to_world(o, desc->to_world);
    mitsuba_rgb(o, "intensity", MITSUBA_EMISSION, desc->intensity);
    desc->cutoff_angle = mitsuba_float(o, "cutoff_angle", 20.0);
    mitsuba_require(o, "cutoff_angle", desc->cutoff_angle > 0.0f && desc->cutoff_angle <= 180.0f, "be in (0, 180]");
    desc->beam_width = mitsuba_float(o, "beam_width", 0.75 * desc->cutoff_angle);
    mitsuba_require(o, "beam_width", desc->beam_width >= 0.0f && desc->beam_width <= desc->cutoff_angle,
                    "be in [0, cutoff_angle]");
    xml_node *texture = mitsuba_object_of(o, "texture", "texture");
    if (texture) desc->texture = mitsuba_read_texture(o->reader, texture);
}

static void read_directional(mitsuba_object *o, brume_light_desc *desc) {
    static const double zero[3] = {0, 0, 0};
    double direction[3], m[16];
    int has_transform = mitsuba_to_world(o, desc->to_world);
    if (mitsuba_vector(o, "direction", direction)) {
        mitsuba_require(o, "direction", !has_transform, "not be given together with to_world");
        if (mitsuba_look_at(zero, direction, zero, m))
            for (int i = 0; i < 16; i++) desc->to_world[i] = (float)m[i];
        else
            mitsuba_require(o, "direction", 0, "not be 0");
    }
    mitsuba_rgb(o, "irradiance", MITSUBA_EMISSION, desc->intensity);
}

static void read_constant(mitsuba_object *o, brume_light_desc *desc) {
    mitsuba_to_world(o, desc->to_world); /* the same from everywhere, whatever the rotation */
    mitsuba_rgb(o, "radiance", MITSUBA_EMISSION, desc->intensity);
}

static void read_envmap(mitsuba_object *o, brume_light_desc *desc, brume_image *image) {
    mitsuba_to_world(o, desc->to_world);
    const char *filename = mitsuba_string(o, "filename", NULL);
    desc->scale = mitsuba_float(o, "scale", 1.0);
    mitsuba_require(o, "scale", desc->scale >= 0.0f, "not be negative");
    mitsuba_boolean(o, "mis_compensation", 0); /* changes noise only */
    mitsuba_require(o, "filename", filename && *filename, "name a picture");
    mitsuba_close(o); /* before the time it takes to read a picture */
    mitsuba_read_picture(o, filename, 0, image);
    desc->width = image->width;
    desc->height = image->height;
    desc->texels = image->texels;
}

void mitsuba_read_emitter(mitsuba_reader *reader, xml_node *node) {
    brume_light_desc desc = brume_light_desc_default(BRUME_LIGHT_POINT);
    brume_image image = {0, 0, NULL};
    mitsuba_object o = mitsuba_open(reader, node);
    read_common(&o);
    if (mitsuba_is(&o, "spot")) {
        desc = brume_light_desc_default(BRUME_LIGHT_SPOT);
        read_spot(&o, &desc);
    } else if (mitsuba_is(&o, "directional")) {
        desc = brume_light_desc_default(BRUME_LIGHT_DIRECTIONAL);
        read_directional(&o, &desc);
    } else if (mitsuba_is(&o, "constant")) {
        desc = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
        read_constant(&o, &desc);
    } else if (mitsuba_is(&o, "envmap")) {
        desc = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
        read_envmap(&o, &desc, &image);
    } else if (mitsuba_is(&o, "area")) {
        mitsuba_fail(reader, node, "an area emitter must be inside a <shape>");
    } else {
        read_point(&o, &desc);
    }
    mitsuba_close(&o);
    if (desc.kind == BRUME_LIGHT_CONSTANT || desc.kind == BRUME_LIGHT_ENVMAP) {
        if (reader->has_environment) mitsuba_fail(reader, node, "a scene has at most one constant or envmap emitter");
        reader->has_environment = 1;
    }
    uint32_t id = BRUME_NONE;
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_add_light(reader->scene, &desc, &id));
    mitsuba_note(reader, node, BRUME_OBJECT_LIGHT, id);
    free(image.texels);
}

void mitsuba_read_area(mitsuba_reader *reader, xml_node *node, float out_radiance[3]) {
    mitsuba_object o = mitsuba_open(reader, node);
    if (!mitsuba_is(&o, "area"))
        mitsuba_fail(reader, node, "a shape's emitter must be an area emitter, not %s", o.type);
    out_radiance[0] = out_radiance[1] = out_radiance[2] = 1.0f;
    mitsuba_rgb(&o, "radiance", MITSUBA_EMISSION, out_radiance);
    read_common(&o);
    mitsuba_close(&o);
}
