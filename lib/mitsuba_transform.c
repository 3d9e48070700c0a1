/* mitsuba_transform.c -- <transform>: its children multiply from the left in the order of the file. */
#include "affine.h"
#include "mitsuba.h"
#include "mitsuba_spelling.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/* m = a m */
static void multiply_left(const double a[16], double m[16]) {
    double out[16];
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            double sum = 0.0;
            for (int k = 0; k < 4; k++) sum += a[4 * i + k] * m[4 * k + j];
            out[4 * i + j] = sum;
        }
    memcpy(m, out, sizeof out);
}

/* A unit vector perpendicular to the unit vector n: Duff et al. 2017, "Building an Orthonormal Basis, Revisited"; the
 * one that Mitsuba takes as up when a look-at has none. */
static void perpendicular(const double n[3], double out[3]) {
    double sign = copysign(1.0, n[2]), a = -1.0 / (sign + n[2]);
    out[0] = 1.0 + sign * n[0] * n[0] * a;
    out[1] = sign * n[0] * n[1] * a;
    out[2] = -sign * n[0];
}

int mitsuba_look_at(const double origin[3], const double target[3], const double up[3], double out[16]) {
    double forward[3] = {target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]};
    double given[3] = {up[0], up[1], up[2]}, left[3], above[3];
    if (!(brume_normalize(forward) > 0.0)) return 0;
    if (given[0] == 0.0 && given[1] == 0.0 && given[2] == 0.0) perpendicular(forward, given);
    if (!(brume_normalize(given) > 0.0)) return 0;
    brume_cross(given, forward, left);
    /* Parallel vectors leave a cross product of rounding errors. */
    if (!(brume_dot(left, left) > 1e-24)) return 0;
    brume_normalize(left);
    brume_cross(forward, left, above);
    for (int i = 0; i < 3; i++) {
        out[4 * i] = left[i];
        out[4 * i + 1] = above[i];
        out[4 * i + 2] = forward[i];
        out[4 * i + 3] = origin[i];
    }
    memcpy(out + 12, identity + 12, 4 * sizeof *out);
    return 1;
}

/* ---- elements --------------------------------------------------------------------------------------------------- */

static void check_attributes(mitsuba_reader *reader, const xml_node *node, const char *const *allowed, int count) {
    for (uint32_t i = 0; i < node->attribute_count; i++) {
        int found = 0;
        for (int j = 0; j < count; j++) found |= strcmp(node->attributes[i].name, allowed[j]) == 0;
        if (!found)
            mitsuba_fail(reader, node, "unexpected attribute '%s' in <%s>", node->attributes[i].name, node->tag);
    }
}

static double number(mitsuba_reader *reader, const xml_node *node, const char *attribute, double otherwise) {
    const char *text = xml_attribute_value(node, attribute);
    double value = otherwise;
    if (text && !mitsuba_parse_number(reader, text, &value)) mitsuba_fail(reader, node, "'%s' is not a number", text);
    return value;
}

/* x, y, z with a default for what is missing, or "value" with one or three numbers. */
static void components(mitsuba_reader *reader, const xml_node *node, double otherwise, double out[3]) {
    static const char *const axes[] = {"x", "y", "z"};
    const char *value = xml_attribute_value(node, "value");
    for (int i = 0; i < 3; i++) {
        if (value && xml_attribute_value(node, axes[i]))
            mitsuba_fail(reader, node, "<%s> has either 'value' or '%s'", node->tag, axes[i]);
        out[i] = number(reader, node, axes[i], otherwise);
    }
    if (!value) return;
    int count = mitsuba_parse_numbers(reader, value, out, 3);
    if (count == 1) out[1] = out[2] = out[0];
    if (count != 1 && count != 3) mitsuba_fail(reader, node, "'%s' is not one or three numbers", value);
}

static void three(mitsuba_reader *reader, const xml_node *node, const char *attribute, int needed, double out[3]) {
    const char *text = xml_attribute_value(node, attribute);
    out[0] = out[1] = out[2] = 0.0;
    if (!text && needed)
        mitsuba_fail(reader, node, "<%s> needs the attribute '%s'", node->tag, attribute);
    else if (text && mitsuba_parse_numbers(reader, text, out, 3) != 3)
        mitsuba_fail(reader, node, "'%s' is not three numbers", text);
}

static void read_translate(mitsuba_reader *reader, const xml_node *node, double m[16]) {
    static const char *const allowed[] = {"x", "y", "z", "value"};
    double v[3];
    check_attributes(reader, node, allowed, 4);
    components(reader, node, 0.0, v);
    memcpy(m, identity, sizeof identity);
    for (int i = 0; i < 3; i++) m[4 * i + 3] = v[i];
}

static void read_scale(mitsuba_reader *reader, const xml_node *node, double m[16]) {
    static const char *const allowed[] = {"x", "y", "z", "value"};
    double v[3];
    check_attributes(reader, node, allowed, 4);
    components(reader, node, 1.0, v);
    memcpy(m, identity, sizeof identity);
    for (int i = 0; i < 3; i++) m[5 * i] = v[i];
}

/* Rodrigues' formula. */
static void read_rotate(mitsuba_reader *reader, const xml_node *node, double m[16]) {
    static const char *const allowed[] = {"x", "y", "z", "value", "angle"};
    const double pi = 3.14159265358979323846;
    double v[3];
    check_attributes(reader, node, allowed, 5);
    components(reader, node, 0.0, v);
    if (!xml_attribute_value(node, "angle")) mitsuba_fail(reader, node, "<rotate> needs the attribute 'angle'");
    double angle = number(reader, node, "angle", 0.0) * (pi / 180.0);
    memcpy(m, identity, sizeof identity);
    if (!(brume_normalize(v) > 0.0)) {
        mitsuba_fail(reader, node, "the axis of a <rotate> must not be 0");
        return;
    }
    double s = sin(angle), c = cos(angle);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) m[4 * i + j] = v[i] * v[j] * (1.0 - c) + (i == j ? c : 0.0);
    m[1] -= s * v[2];
    m[2] += s * v[1];
    m[4] += s * v[2];
    m[6] -= s * v[0];
    m[8] -= s * v[1];
    m[9] += s * v[0];
}

static void read_matrix(mitsuba_reader *reader, const xml_node *node, double m[16]) {
    static const char *const allowed[] = {"value"};
    double v[16];
    memcpy(m, identity, sizeof identity);
    check_attributes(reader, node, allowed, 1);
    const char *text = xml_attribute_value(node, "value");
    if (!text) {
        mitsuba_fail(reader, node, "<matrix> needs the attribute 'value'");
        return;
    }
    int count = mitsuba_parse_numbers(reader, text, v, 16);
    if (count == 16)
        memcpy(m, v, sizeof v);
    else if (count == 9)
        for (int i = 0; i < 3; i++) memcpy(m + 4 * i, v + 3 * i, 3 * sizeof *m);
    else
        mitsuba_fail(reader, node, "'%s' is not 9 or 16 numbers", text);
}

static void read_look_at(mitsuba_reader *reader, const xml_node *node, double m[16]) {
    static const char *const allowed[] = {"origin", "target", "up"};
    double origin[3], target[3], up[3];
    check_attributes(reader, node, allowed, 3);
    three(reader, node, "origin", 1, origin);
    three(reader, node, "target", 1, target);
    three(reader, node, "up", 0, up);
    if (reader->result == BRUME_OK && !mitsuba_look_at(origin, target, up, m))
        mitsuba_fail(reader, node, "<lookat> needs a target away from the origin, in another direction than up");
}

int mitsuba_transform(mitsuba_object *o, const char *name, double out[16]) {
    mitsuba_reader *reader = o->reader;
    memcpy(out, identity, sizeof identity);
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p) return 0;
    if (strcmp(p->node->tag, "transform") != 0) {
        mitsuba_fail(reader, p->node, "property '%s' of %s must be a <transform>, not a <%s>", name, o->type,
                     p->node->tag);
        return 0;
    }
    for (const xml_node *node = p->node->first; node && reader->result == BRUME_OK; node = node->next) {
        static const char *const tags[] = {"translate", "scale", "rotate", "matrix", "lookat"};
        double m[16];
        memcpy(m, identity, sizeof m);
        if (strcmp(node->tag, "translate") == 0)
            read_translate(reader, node, m);
        else if (strcmp(node->tag, "scale") == 0)
            read_scale(reader, node, m);
        else if (strcmp(node->tag, "rotate") == 0)
            read_rotate(reader, node, m);
        else if (strcmp(node->tag, "matrix") == 0)
            read_matrix(reader, node, m);
        else if (strcmp(node->tag, "lookat") == 0)
            read_look_at(reader, node, m);
        else {
            const char *near = mitsuba_nearest(node->tag, tags, 5);
            if (near)
                mitsuba_fail(reader, node, "unknown transform <%s>; did you mean <%s>?", node->tag, near);
            else
                mitsuba_fail(reader, node, "unknown transform <%s>", node->tag);
        }
        if (node->first) mitsuba_fail(reader, node->first, "<%s> can't be inside <%s>", node->first->tag, node->tag);
        multiply_left(m, out);
    }
    for (int i = 0; i < 16; i++)
        if (!(fabs(out[i]) <= FLT_MAX)) mitsuba_fail(reader, p->node, "the transform's numbers are too large");
    return reader->result == BRUME_OK;
}

int mitsuba_to_world(mitsuba_object *o, float out[16]) {
    double m[16];
    int there = mitsuba_transform(o, "to_world", m);
    if (there) {
        double columns[3];
        brume_cross((double[]){m[0], m[4], m[8]}, (double[]){m[1], m[5], m[9]}, columns);
        double determinant = columns[0] * m[2] + columns[1] * m[6] + columns[2] * m[10];
        mitsuba_require(o, "to_world", m[12] == 0.0 && m[13] == 0.0 && m[14] == 0.0 && m[15] == 1.0,
                        "be affine: 0 0 0 1 in the last row");
        mitsuba_require(o, "to_world", fabs(determinant) > 0.0, "not be singular");
    }
    for (int i = 0; i < 16; i++) out[i] = (float)m[i];
    return there;
}
