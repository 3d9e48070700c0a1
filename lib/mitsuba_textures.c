/* mitsuba_textures.c -- bitmap and checkerboard. */
#include "mitsuba.h"

#include <stdlib.h>
#include <string.h>

/* Before version 2 there were u and v factors and offsets: scale times translation. */
static int read_old_to_uv(mitsuba_object *o, float out[6]) {
    if (o->node->file->major >= 2) return 0;
    double no_transform[16];
    float u_scale = mitsuba_float(o, "uscale", 1.0), v_scale = mitsuba_float(o, "vscale", 1.0);
    float u_offset = mitsuba_float(o, "uoffset", 0.0), v_offset = mitsuba_float(o, "voffset", 0.0);
    if (u_scale == 1.0f && v_scale == 1.0f && u_offset == 0.0f && v_offset == 0.0f) return 0;
    mitsuba_require(o, "to_uv", !mitsuba_transform(o, "to_uv", no_transform),
                    "not be mixed with uscale, vscale and offsets");
    memcpy(out, (float[6]){u_scale, 0.0f, u_scale * u_offset, 0.0f, v_scale, v_scale * v_offset}, 6 * sizeof *out);
    return 1;
}

/* What of the 4x4 matrix acts on (u, v). */
static void read_to_uv(mitsuba_object *o, float out[6]) {
    double m[16];
    if (read_old_to_uv(o, out) || !mitsuba_transform(o, "to_uv", m)) return;
    mitsuba_require(o, "to_uv", m[12] == 0.0 && m[13] == 0.0 && m[14] == 0.0 && m[15] == 1.0,
                    "be affine: 0 0 0 1 in the last row");
    memcpy(out, (float[6]){(float)m[0], (float)m[1], (float)m[3], (float)m[4], (float)m[5], (float)m[7]},
           6 * sizeof *out);
}

void mitsuba_read_picture(mitsuba_object *o, const char *filename, int raw, brume_image *out) {
    const char *where, *path = mitsuba_path(o, filename, &where);
    if (path)
        mitsuba_keep(o->reader, o->node, brume_image_read(o->reader->context, path, raw, where, out));
}

static void read_bitmap(mitsuba_object *o, brume_texture_desc *desc, brume_image *image) {
    const char *filename = mitsuba_string(o, "filename", NULL);
    const char *filter = mitsuba_string(o, "filter_type", "bilinear");
    const char *wrap = mitsuba_string(o, "wrap_mode", "repeat");
    int raw = mitsuba_boolean(o, "raw", 0);
    read_to_uv(o, desc->to_uv);
    /* How Mitsuba stores and looks up texels on its device. */
    mitsuba_string(o, "format", NULL);
    mitsuba_boolean(o, "accel", 1);
    mitsuba_close(o);
    mitsuba_require(o, "filename", filename && *filename, "name a picture");
    desc->filter = strcmp(filter, "nearest") == 0 ? BRUME_FILTER_NEAREST : BRUME_FILTER_BILINEAR;
    mitsuba_require(o, "filter_type", !strcmp(filter, "nearest") || !strcmp(filter, "bilinear"),
                    "be bilinear or nearest");
    desc->wrap = strcmp(wrap, "mirror") == 0  ? BRUME_WRAP_MIRROR
                 : strcmp(wrap, "clamp") == 0 ? BRUME_WRAP_CLAMP
                                              : BRUME_WRAP_REPEAT;
    mitsuba_require(o, "wrap_mode", !strcmp(wrap, "repeat") || !strcmp(wrap, "mirror") || !strcmp(wrap, "clamp"),
                    "be repeat, mirror or clamp");
    mitsuba_read_picture(o, filename, raw, image);
    desc->width = image->width;
    desc->height = image->height;
    desc->texels = image->texels;
}

static void read_checkerboard(mitsuba_object *o, brume_texture_desc *desc) {
    desc->kind = BRUME_TEXTURE_CHECKERBOARD;
    mitsuba_rgb(o, "color0", MITSUBA_REFLECTANCE, desc->color0);
    mitsuba_rgb(o, "color1", MITSUBA_REFLECTANCE, desc->color1);
    read_to_uv(o, desc->to_uv);
    mitsuba_close(o);
}

uint32_t mitsuba_read_texture(mitsuba_reader *reader, xml_node *node) {
    if (!mitsuba_begin(reader, node)) return node->id;
    brume_texture_desc desc = brume_texture_desc_default();
    brume_image image = {0, 0, NULL};
    mitsuba_object o = mitsuba_open(reader, node);
    if (mitsuba_is(&o, "bitmap"))
        read_bitmap(&o, &desc, &image);
    else
        read_checkerboard(&o, &desc);
    uint32_t id = BRUME_NONE;
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_add_texture(reader->scene, &desc, &id));
    mitsuba_note(reader, node, BRUME_OBJECT_TEXTURE, id);
    free(image.texels);
    mitsuba_end(node, id);
    return id;
}

int mitsuba_rgb_or_texture(mitsuba_object *o, const char *name, mitsuba_color kind, float out[3],
                           uint32_t *out_texture) {
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p || !p->object) return mitsuba_rgb(o, name, kind, out);
    if (strcmp(p->object->tag, "texture") != 0) {
        mitsuba_fail(o->reader, p->node, "property '%s' of %s must be a colour or a <texture>, not a <%s>", name,
                     o->type, p->object->tag);
        return 0;
    }
    *out_texture = mitsuba_read_texture(o->reader, p->object);
    return o->reader->result == BRUME_OK;
}
