/* mitsuba_sensor.c -- perspective and thinlens. */
#include "mitsuba.h"

#include <math.h>
#include <string.h>

/* The field of view of a lens on 35 mm film, over the diagonal of its 36 mm x 24 mm. */
static double fov_of_focal_length(double millimetres) {
    const double pi = 3.14159265358979323846;
    return 2.0 * atan(sqrt(36.0 * 36.0 + 24.0 * 24.0) / (2.0 * millimetres)) * (180.0 / pi);
}

static void read_focal_length(mitsuba_object *o, brume_sensor_desc *desc) {
    const char *text = mitsuba_string(o, "focal_length", "50mm");
    size_t length = strlen(text);
    char *number = xml_tree_copy(o->reader->tree, text, length);
    if (!number) {
        mitsuba_fail_memory(o->reader);
        return;
    }
    if (length > 2 && strcmp(number + length - 2, "mm") == 0) number[length - 2] = '\0';
    double millimetres = 0.0;
    int is_number = mitsuba_parse_number(o->reader, number, &millimetres);
    mitsuba_require(o, "focal_length", is_number && millimetres > 0.0, "be a length such as 50mm");
    desc->fov = (float)fov_of_focal_length(millimetres);
    desc->fov_axis = BRUME_FOV_DIAGONAL;
}

static void read_fov(mitsuba_object *o, brume_sensor_desc *desc) {
    static const char *const axes[] = {"x", "y", "diagonal", "smaller", "larger"}; /* as brume_fov_axis */
    if (!mitsuba_find(o, "fov")) {
        mitsuba_require(o, "fov_axis", !mitsuba_find(o, "fov_axis"), "come with a fov");
        read_focal_length(o, desc);
        return;
    }
    mitsuba_require(o, "focal_length", !mitsuba_find(o, "focal_length"), "not be given together with fov");
    desc->fov = mitsuba_float(o, "fov", 0.0);
    mitsuba_require(o, "fov", desc->fov > 0.0f && desc->fov < 180.0f, "be in (0, 180)");
    const char *axis = mitsuba_string(o, "fov_axis", "x");
    int index = 0;
    while (index < 5 && strcmp(axis, axes[index]) != 0) index++;
    mitsuba_require(o, "fov_axis", index < 5, "be x, y, diagonal, smaller or larger");
    desc->fov_axis = (brume_fov_axis)index;
}

/* Rows and columns of unit length, perpendicular: a reflection is fine. */
static void check_rigid(mitsuba_object *o, const float m[16]) {
    int rigid = 1;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double dot = 0.0;
            for (int k = 0; k < 3; k++) dot += (double)m[4 * k + i] * m[4 * k + j];
            rigid &= fabs(dot - (i == j)) < 1e-3;
        }
    mitsuba_require(o, "to_world", rigid, "not scale");
}

void mitsuba_read_sensor(mitsuba_reader *reader, xml_node *node) {
    mitsuba_object o = mitsuba_open(reader, node);
    brume_sensor_desc desc = brume_sensor_desc_default();
    brume_film_desc film = brume_film_desc_default();
    if (mitsuba_to_world(&o, desc.to_world)) check_rigid(&o, desc.to_world);
    read_fov(&o, &desc);
    desc.near_clip = mitsuba_float(&o, "near_clip", 1e-2);
    desc.far_clip = mitsuba_float(&o, "far_clip", 1e4);
    mitsuba_require(&o, "near_clip", desc.near_clip > 0.0f, "be positive");
    mitsuba_require(&o, "far_clip", desc.far_clip > desc.near_clip, "be larger than near_clip");
    desc.focus_distance = mitsuba_float(&o, "focus_distance", desc.far_clip); /* a pinhole's has no effect */
    mitsuba_require(&o, "focus_distance", desc.focus_distance > 0.0f, "be positive");
    if (mitsuba_is(&o, "thinlens")) {
        mitsuba_require(&o, "aperture_radius", mitsuba_find(&o, "aperture_radius") != NULL, "be given");
        desc.aperture_radius = mitsuba_float(&o, "aperture_radius", 0.0);
        mitsuba_require(&o, "aperture_radius", desc.aperture_radius >= 0.0f, "not be negative");
    }
    /* Nothing moves, so the shutter has no effect. */
    float opens = mitsuba_float(&o, "shutter_open", 0.0), closes = mitsuba_float(&o, "shutter_close", 0.0);
    mitsuba_require(&o, "shutter_close", closes >= opens, "not be before shutter_open");
    float offset_x = mitsuba_float(&o, "principal_point_offset_x", 0.0);
    float offset_y = mitsuba_float(&o, "principal_point_offset_y", 0.0);
    mitsuba_require(&o, "principal_point_offset_x", offset_x == 0.0f, "be 0; shifted lenses are not supported yet");
    mitsuba_require(&o, "principal_point_offset_y", offset_y == 0.0f, "be 0; shifted lenses are not supported yet");

    desc.medium = mitsuba_read_endpoint_medium(&o);
    const mitsuba_property *p = mitsuba_child(&o, "film");
    if (p) mitsuba_read_film(reader, p->object, &film);
    if (mitsuba_child(&o, "film")) mitsuba_fail(reader, node, "a sensor has at most one <film>");
    p = mitsuba_child(&o, "sampler");
    if (p) mitsuba_read_sampler(reader, p->object);
    if (mitsuba_child(&o, "sampler")) mitsuba_fail(reader, node, "a sensor has at most one <sampler>");
    mitsuba_close(&o);
    if (reader->has_sensor) mitsuba_fail(reader, node, "a second sensor is not supported yet");
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_set_sensor(reader->scene, &desc));
    mitsuba_note(reader, node, BRUME_OBJECT_SENSOR, 0);
    reader->has_sensor = 1;
}
