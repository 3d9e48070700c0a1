/* mitsuba_values.c -- typed values: strict numbers, strings, vectors and colours. */
#include "mitsuba.h"
#include "spectrum.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- numbers ---------------------------------------------------------------------------------------------------- */

static int is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
static int is_digit(char c) { return c >= '0' && c <= '9'; }

/* The end of the decimal number that starts here; NULL if none does. strtod alone would also take hexadecimal numbers,
 * infinities and NaN. */
static const char *number_end(const char *c) {
    int digits = 0;
    if (*c == '+' || *c == '-') c++;
    for (; is_digit(*c); c++) digits++;
    if (*c == '.') c++;
    for (; is_digit(*c); c++) digits++;
    if (!digits) return NULL;
    if (*c == 'e' || *c == 'E') {
        c++;
        if (*c == '+' || *c == '-') c++;
        if (!is_digit(*c)) return NULL;
        while (is_digit(*c)) c++;
    }
    return c;
}

int mitsuba_parse_numbers(const mitsuba_reader *reader, const char *text, double *out, int max) {
    int count = 0;
    for (;;) {
        while (is_space(*text) || *text == ',') text++;
        if (!*text) return count;
        const char *end = number_end(text);
        if (!end || (*end && !is_space(*end) && *end != ',')) return -1;
        if (count == max) return max + 1;
        double value = brume_c_locale_strtod(reader->locale, text);
        if (!(fabs(value) <= FLT_MAX)) return -1; /* everything ends up in a float */
        out[count++] = value;
        text = end;
    }
}

int mitsuba_parse_number(const mitsuba_reader *reader, const char *text, double *out) {
    return !strchr(text, ',') && mitsuba_parse_numbers(reader, text, out, 1) == 1;
}

static int parse_integer(const char *text, int64_t *out) {
    while (is_space(*text)) text++;
    int negative = *text == '-';
    if (negative) text++;
    if (!is_digit(*text)) return 0;
    int64_t value = 0;
    for (; is_digit(*text); text++) {
        if (value > (INT64_MAX - 9) / 10) return 0;
        value = 10 * value + (*text - '0');
    }
    while (is_space(*text)) text++;
    *out = negative ? -value : value;
    return !*text;
}

/* ---- single values ---------------------------------------------------------------------------------------------- */

static const char *an(const char *tag) { return tag[0] == 'i' ? "an" : "a"; }

/* The property if it is there and of that type. */
static const mitsuba_property *find_typed(mitsuba_object *o, const char *name, const char *tag, const char *other) {
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p || strcmp(p->node->tag, tag) == 0 || (other && strcmp(p->node->tag, other) == 0)) return p;
    mitsuba_fail(o->reader, p->node, "property '%s' of %s must be %s <%s>, not %s <%s>", name, o->type, an(tag), tag,
                 an(p->node->tag), p->node->tag);
    return NULL;
}

static const char *value_of(const mitsuba_property *p) { return xml_attribute_value(p->node, "value"); }

static double number_of(mitsuba_object *o, const mitsuba_property *p, double otherwise) {
    double value = otherwise;
    if (!mitsuba_parse_number(o->reader, value_of(p), &value))
        mitsuba_fail(o->reader, p->node, "'%s' is not a number", value_of(p));
    return value;
}

float mitsuba_float(mitsuba_object *o, const char *name, double otherwise) {
    const mitsuba_property *p = find_typed(o, name, "float", "integer");
    return (float)(p ? number_of(o, p, otherwise) : otherwise);
}

int64_t mitsuba_integer(mitsuba_object *o, const char *name, int64_t otherwise) {
    const mitsuba_property *p = find_typed(o, name, "integer", NULL);
    int64_t value = otherwise;
    if (p && !parse_integer(value_of(p), &value)) {
        mitsuba_fail(o->reader, p->node, "'%s' is not a whole number", value_of(p));
        return otherwise;
    }
    return value;
}

static int same_letters(const char *text, const char *lower) {
    for (; *text && *lower; text++, lower++)
        if ((*text >= 'A' && *text <= 'Z' ? *text - 'A' + 'a' : *text) != *lower) return 0;
    return *text == *lower;
}

int mitsuba_boolean(mitsuba_object *o, const char *name, int otherwise) {
    const mitsuba_property *p = find_typed(o, name, "boolean", NULL);
    if (!p) return otherwise;
    if (same_letters(value_of(p), "true")) return 1;
    if (!same_letters(value_of(p), "false"))
        mitsuba_fail(o->reader, p->node, "'%s' is neither true nor false", value_of(p));
    return 0;
}

const char *mitsuba_string(mitsuba_object *o, const char *name, const char *otherwise) {
    const mitsuba_property *p = find_typed(o, name, "string", NULL);
    return p ? value_of(p) : otherwise;
}

/* "value" with one or three numbers, or x, y and z. */
int mitsuba_vector(mitsuba_object *o, const char *name, double out[3]) {
    const mitsuba_property *p = find_typed(o, name, "vector", "point");
    if (!p) return 0;
    double v[3] = {0, 0, 0};
    const char *value = value_of(p);
    if (value) {
        int count = mitsuba_parse_numbers(o->reader, value, v, 3);
        if (count == 1) v[1] = v[2] = v[0];
        if (count != 1 && count != 3) mitsuba_fail(o->reader, p->node, "'%s' is not one or three numbers", value);
    } else {
        static const char *const axes[] = {"x", "y", "z"};
        for (int i = 0; i < 3; i++) {
            const char *text = xml_attribute_value(p->node, axes[i]);
            if (!mitsuba_parse_number(o->reader, text, &v[i]))
                mitsuba_fail(o->reader, p->node, "'%s' is not a number", text);
        }
    }
    memcpy(out, v, sizeof v);
    return o->reader->result == BRUME_OK;
}

/* ---- colours ---------------------------------------------------------------------------------------------------- */

static void check_rgb(mitsuba_object *o, const mitsuba_property *p, mitsuba_color kind, const double rgb[3]) {
    for (int i = 0; i < 3; i++) {
        if (rgb[i] < 0.0)
            mitsuba_fail(o->reader, p->node, "property '%s' of %s must not be negative", p->name, o->type);
        if (kind == MITSUBA_REFLECTANCE && rgb[i] > 1.0)
            mitsuba_fail(o->reader, p->node, "property '%s' of %s must be in [0, 1]", p->name, o->type);
    }
}

/* A saturated spectrum lies outside of what RGB can say; Mitsuba 3 clamps it with a warning, and so do we. */
static void clamp_rgb(mitsuba_object *o, const mitsuba_property *p, mitsuba_color kind, double rgb[3]) {
    double before[3] = {rgb[0], rgb[1], rgb[2]};
    int changed = 0;
    for (int i = 0; i < 3; i++) {
        if (rgb[i] < 0.0) rgb[i] = 0.0, changed = 1;
        if (kind == MITSUBA_REFLECTANCE && rgb[i] > 1.0) rgb[i] = 1.0, changed = 1;
    }
    if (changed)
        mitsuba_warn(o->reader, p->node, "the spectrum is RGB (%.4g, %.4g, %.4g), which was clamped", before[0],
                     before[1], before[2]);
}

/* "wavelength:value, ...". */
static void parse_spectrum(mitsuba_object *o, const mitsuba_property *p, mitsuba_color kind, double rgb[3]) {
    const char *text = value_of(p), *c = text;
    size_t max = 1, count = 0;
    for (const char *colon = text; (colon = strchr(colon, ':')); colon++) max++;
    double *wavelengths = xml_tree_alloc(o->reader->tree, 2 * max * sizeof *wavelengths);
    if (!wavelengths) {
        mitsuba_fail_memory(o->reader);
        return;
    }
    double *values = wavelengths + max;
    for (;;) {
        while (is_space(*c) || *c == ',') c++;
        if (!*c) break;
        const char *colon = number_end(c);
        const char *end = colon && *colon == ':' ? number_end(colon + 1) : NULL;
        if (!end || (*end && !is_space(*end) && *end != ',')) {
            mitsuba_fail(o->reader, p->node, "'%s' is not a list of wavelength:value pairs", text);
            return;
        }
        wavelengths[count] = brume_c_locale_strtod(o->reader->locale, c);
        values[count] = brume_c_locale_strtod(o->reader->locale, colon + 1);
        if (!(wavelengths[count] > 0.0 && wavelengths[count] <= FLT_MAX && values[count] >= 0.0 &&
              values[count] <= FLT_MAX)) {
            mitsuba_fail(o->reader, p->node,
                         "a spectrum's wavelengths must be positive and its values must not be negative");
            return;
        }
        if (count && wavelengths[count] <= wavelengths[count - 1]) {
            mitsuba_fail(o->reader, p->node, "a spectrum's wavelengths must ascend");
            return;
        }
        count++;
        c = end;
    }
    if (count < 2) {
        mitsuba_fail(o->reader, p->node, "a spectrum needs two wavelengths at least, or one value for all");
        return;
    }
    brume_spectrum_use use = kind == MITSUBA_EMISSION ? BRUME_SPECTRUM_EMISSION : BRUME_SPECTRUM_REFLECTION;
    brume_spectrum_to_rgb(wavelengths, values, count, use, rgb);
    clamp_rgb(o, p, kind, rgb);
}

static void parse_rgb(mitsuba_object *o, const mitsuba_property *p, double rgb[3]) {
    int count = mitsuba_parse_numbers(o->reader, value_of(p), rgb, 3);
    if (count == 1) rgb[1] = rgb[2] = rgb[0];
    if (count != 1 && count != 3) mitsuba_fail(o->reader, p->node, "'%s' is not one or three numbers", value_of(p));
}

static int color_of(mitsuba_object *o, const mitsuba_property *p, mitsuba_color kind, float out[3]) {
    const char *tag = p->node->tag;
    double rgb[3] = {0, 0, 0};
    if (strcmp(tag, "rgb") == 0) {
        parse_rgb(o, p, rgb);
        check_rgb(o, p, kind, rgb);
    } else if (strcmp(tag, "float") == 0 || strcmp(tag, "integer") == 0) {
        rgb[0] = rgb[1] = rgb[2] = number_of(o, p, 0.0);
        check_rgb(o, p, kind, rgb);
    } else if (strcmp(tag, "spectrum") == 0 && strchr(value_of(p), ':')) {
        parse_spectrum(o, p, kind, rgb);
    } else if (strcmp(tag, "spectrum") == 0) {
        double value = number_of(o, p, 0.0);
        double grey[3] = {value, value, value};
        check_rgb(o, p, kind, grey);
        brume_spectrum_constant_to_rgb(
            value, kind == MITSUBA_EMISSION ? BRUME_SPECTRUM_EMISSION : BRUME_SPECTRUM_REFLECTION, rgb);
    } else {
        mitsuba_fail(o->reader, p->node, "property '%s' of %s must be a colour, not %s <%s>", p->name, o->type, an(tag),
                     tag);
    }
    if (o->reader->result != BRUME_OK) return 0;
    for (int i = 0; i < 3; i++) out[i] = (float)rgb[i];
    return 1;
}

int mitsuba_rgb(mitsuba_object *o, const char *name, mitsuba_color kind, float out[3]) {
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p) return 0;
    if (!p->object) return color_of(o, p, kind, out);
    mitsuba_fail(o->reader, p->node, "a <%s> for property '%s' of %s is not supported yet", p->object->tag, name,
                 o->type);
    return 0;
}
