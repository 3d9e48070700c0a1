/* mitsuba_film.c -- hdrfilm with its reconstruction filter, and samplers. */
#include "mitsuba.h"

#include <string.h>

static uint32_t read_size(mitsuba_object *o, const char *name, int64_t otherwise, int64_t least) {
    int64_t value = mitsuba_integer(o, name, otherwise);
    mitsuba_require(o, name, value >= least && value <= 65536, least ? "be in [1, 65536]" : "be in [0, 65536]");
    return (uint32_t)value;
}

static void read_filter(mitsuba_reader *reader, xml_node *node, brume_film_desc *out) {
    mitsuba_object o = mitsuba_open(reader, node);
    if (mitsuba_is(&o, "box")) {
        out->rfilter = BRUME_RFILTER_BOX;
    } else if (mitsuba_is(&o, "tent")) {
        out->rfilter = BRUME_RFILTER_TENT;
        out->filter_radius = mitsuba_float(&o, "radius", 1.0);
        mitsuba_require(&o, "radius", out->filter_radius > 0.0f && out->filter_radius <= 64.0f, "be in (0, 64]");
    } else if (mitsuba_is(&o, "mitchell")) {
        out->rfilter = BRUME_RFILTER_MITCHELL;
        out->filter_b = mitsuba_float(&o, "B", 1.0 / 3.0);
        out->filter_c = mitsuba_float(&o, "C", 1.0 / 3.0);
    } else if (mitsuba_is(&o, "catmullrom")) {
        out->rfilter = BRUME_RFILTER_CATMULLROM;
    } else if (mitsuba_is(&o, "lanczos")) {
        out->rfilter = BRUME_RFILTER_LANCZOS;
        int64_t lobes = mitsuba_integer(&o, "lobes", 3);
        mitsuba_require(&o, "lobes", lobes >= 1 && lobes <= 16, "be in [1, 16]");
        out->filter_lobes = (uint32_t)lobes;
    } else {
        out->rfilter = BRUME_RFILTER_GAUSSIAN;
        out->filter_stddev = mitsuba_float(&o, "stddev", 0.5);
        mitsuba_require(&o, "stddev", out->filter_stddev > 0.0f, "be positive");
    }
    mitsuba_close(&o);
    node->mark = XML_READ;
}

static int one_of(const char *text, const char *a, const char *b) { return !strcmp(text, a) || !strcmp(text, b); }

void mitsuba_read_film(mitsuba_reader *reader, xml_node *node, brume_film_desc *out) {
    mitsuba_object o = mitsuba_open(reader, node);
    out->width = read_size(&o, "width", 768, 1);
    out->height = read_size(&o, "height", 576, 1);
    out->crop_x = read_size(&o, "crop_offset_x", 0, 0);
    out->crop_y = read_size(&o, "crop_offset_y", 0, 0);
    out->crop_width = read_size(&o, "crop_width", out->width, 1);
    out->crop_height = read_size(&o, "crop_height", out->height, 1);
    if ((uint64_t)out->crop_x + out->crop_width > out->width || (uint64_t)out->crop_y + out->crop_height > out->height)
        mitsuba_fail(reader, node, "the crop of %u x %u at (%u, %u) leaves the film of %u x %u", out->crop_width,
                     out->crop_height, out->crop_x, out->crop_y, out->width, out->height);

    const char *pixel = mitsuba_string(&o, "pixel_format", "rgb");
    mitsuba_require(&o, "pixel_format", one_of(pixel, "rgb", "rgba"), "be rgb or rgba; others are not supported yet");
    out->alpha = strcmp(pixel, "rgba") == 0;
    const char *component = mitsuba_string(&o, "component_format", "float16");
    mitsuba_require(&o, "component_format", one_of(component, "float16", "float32"),
                    "be float16 or float32; others are not supported yet");
    out->half = strcmp(component, "float16") == 0;
    const char *format = mitsuba_string(&o, "file_format", "openexr");
    if (!one_of(format, "openexr", "exr"))
        mitsuba_warn(reader, node, "file_format '%s' is ignored: the name of the picture decides", format);
    if (mitsuba_boolean(&o, "sample_border", 0))
        mitsuba_warn(reader, node, "sample_border is ignored; it changes the outermost pixels' noise only");
    mitsuba_boolean(&o, "compensate", 0); /* how Mitsuba adds up samples */
    mitsuba_boolean(&o, "banner", 0);

    const mitsuba_property *filter = mitsuba_child(&o, "rfilter");
    if (filter) read_filter(reader, filter->object, out);
    if (mitsuba_child(&o, "rfilter")) mitsuba_fail(reader, node, "a film has at most one <rfilter>");
    mitsuba_close(&o);
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_set_film(reader->scene, out));
    node->mark = XML_READ;
}

/* All become Sobol': it stratifies at least as well as those that do. `independent` too: it is what Mitsuba's files say
 * when they say nothing in particular, and two to four times the error would be a high price for that. */
void mitsuba_read_sampler(mitsuba_reader *reader, xml_node *node) {
    mitsuba_object o = mitsuba_open(reader, node);
    brume_integrator_desc *desc = &reader->integrator;
    desc->sampler = BRUME_SAMPLER_SOBOL;
    int64_t count = mitsuba_integer(&o, "sample_count", desc->sample_count);
    mitsuba_require(&o, "sample_count", count >= 1 && count <= INT32_MAX, "be in [1, 2147483647]");
    int64_t seed = mitsuba_integer(&o, "seed", 0);
    mitsuba_require(&o, "seed", seed >= 0 && seed <= UINT32_MAX, "be in [0, 4294967295]");
    int jitters = mitsuba_is(&o, "stratified") || mitsuba_is(&o, "multijitter") || mitsuba_is(&o, "orthogonal");
    if (jitters && !mitsuba_boolean(&o, "jitter", 1))
        mitsuba_warn(reader, node, "jitter is ignored: samples are always random");
    if (mitsuba_is(&o, "orthogonal")) mitsuba_integer(&o, "strength", 2); /* of a stratification that is not ours */
    mitsuba_close(&o);
    if (reader->result == BRUME_OK) {
        desc->sample_count = (uint32_t)count;
        desc->seed = (uint32_t)seed;
    }
    node->mark = XML_READ;
}
