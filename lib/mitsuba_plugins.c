/* mitsuba_plugins.c -- which plugins there are: those we read, and those that Mitsuba 3 has besides, so that an error
 * can tell a slip of the pen from something that is missing here. */
#include "mitsuba.h"
#include "mitsuba_spelling.h"

#include <stdio.h>
#include <string.h>

#define MAX_NAMES 32

typedef struct plugin_list {
    const char *tag;
    const char *supported[MAX_NAMES]; /* NULL-terminated, as is the other */
    const char *missing[MAX_NAMES];
} plugin_list;

static const plugin_list plugin_lists[] = {
    {"bsdf",
     {"diffuse", "dielectric", "thindielectric", "conductor", "roughconductor", "twosided", "null"},
     {"roughdielectric", "plastic", "roughplastic", "principled", "principledthin", "mask", "bumpmap",
      "normalmap", "blendbsdf", "hair", "measured", "measured_polarized", "circular", "polarizer", "pplastic",
      "retarder", "neural"}},
    {"shape",
     {"obj", "ply", "rectangle", "cube", "sphere", "disk"},
     {"cylinder", "instance", "shapegroup", "serialized", "blender", "merge", "sdfgrid", "bsplinecurve", "linearcurve",
      "ellipsoids", "ellipsoidsmesh"}},
    {"emitter",
     {"area", "point", "spot", "directional", "constant", "envmap"},
     {"projector", "directionalarea", "sunsky", "timed_sunsky", "volumelight"}},
    {"sensor",
     {"perspective", "thinlens"},
     {"orthographic", "batch", "distant", "irradiancemeter", "radiancemeter", "mradiancemeter"}},
    {"film", {"hdrfilm"}, {"specfilm", "ldrfilm"}},
    {"rfilter", {"box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"}, {NULL}},
    {"sampler", {"independent", "stratified", "multijitter", "orthogonal", "ldsampler"}, {NULL}},
    {"integrator",
     {"path", "volpath", "volpathmis", "direct"},
     {"aov", "moment", "depth", "stokes", "ptracer", "prb", "prb_basic", "prbvolpath", "direct_projective",
      "prb_projective", "volprim_rf_basic"}},
    {"medium", {"homogeneous"}, {"heterogeneous", "piecewise"}},
    {"phase", {"isotropic", "hg"}, {"rayleigh", "blendphase", "sggx", "tabphase", "tabphase_polarized"}},
    {"volume", {NULL}, {"constvolume", "gridvolume", "sh_volume"}},
    {"texture",
     {"bitmap", "checkerboard"},
     {"mesh_attribute", "volume", "uniform", "srgb", "d65", "srgb_d65", "blackbody", "regular", "irregular",
      "rawconstant"}},
};

enum { LIST_COUNT = sizeof plugin_lists / sizeof plugin_lists[0] };

int mitsuba_is_object_tag(const char *tag) {
    for (int i = 0; i < LIST_COUNT; i++)
        if (strcmp(tag, plugin_lists[i].tag) == 0) return 1;
    return 0;
}

static size_t names_in(const char *const *names) {
    size_t count = 0;
    while (count < MAX_NAMES && names[count]) count++;
    return count;
}

static int contains(const char *const *names, const char *name) {
    for (size_t i = 0; i < names_in(names); i++)
        if (strcmp(names[i], name) == 0) return 1;
    return 0;
}

/* "; there are a, b and c", or nothing where there is none. */
static const char *those_there_are(const plugin_list *list, char *out, size_t size) {
    size_t count = names_in(list->supported), used = 0;
    out[0] = 0;
    for (size_t i = 0; i < count && used < size; i++) {
        const char *before = i + 1 < count ? ", " : " and ";
        if (i == 0) before = count == 1 ? "; there is " : "; there are ";
        used += (size_t)snprintf(out + used, size - used, "%s%s", before, list->supported[i]);
    }
    return out;
}

void mitsuba_check_plugin(mitsuba_object *object) {
    const plugin_list *list = NULL;
    const char *tag = object->node->tag;
    for (int i = 0; i < LIST_COUNT; i++)
        if (strcmp(tag, plugin_lists[i].tag) == 0) list = &plugin_lists[i];
    if (!list || contains(list->supported, object->type)) return;
    char there[256];
    if (contains(list->missing, object->type)) {
        mitsuba_fail(object->reader, object->node, "the %s plugin '%s' is not supported yet%s", tag, object->type,
                     those_there_are(list, there, sizeof there));
        return;
    }
    const char *names[2 * MAX_NAMES];
    size_t supported = names_in(list->supported), missing = names_in(list->missing);
    memcpy(names, list->supported, supported * sizeof names[0]);
    memcpy(names + supported, list->missing, missing * sizeof names[0]);
    const char *near = mitsuba_nearest(object->type, names, supported + missing);
    if (near)
        mitsuba_fail(object->reader, object->node, "unknown %s plugin '%s'; did you mean '%s'?", tag, object->type,
                     near);
    else
        mitsuba_fail(object->reader, object->node, "unknown %s plugin '%s'%s", tag, object->type,
                     those_there_are(list, there, sizeof there));
}
