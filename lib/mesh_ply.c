/* mesh_ply.c -- PLY meshes (Turk 1994): ASCII and binary of either byte order.
 *
 * The one library for it that systems package, assimp, does not end on a header that is cut off, ends the process by an
 * assertion at a face without vertices, and reads outside of arrays where a polygon names a vertex that isn't there
 * (5.2.4, all three found by fuzzing). Here nothing is allocated for what the file is too short to hold.
 */
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "load_progress.h"
#include "mesh_finish.h"
#include "mesh_polygon.h"
#include "platform.h"
#include "text.h"

enum { MOST_ELEMENTS = 32, MOST_PROPERTIES = 64, MOST_WORDS = 5, MOST_LETTERS = 64 };

typedef enum value_type { NO_TYPE, INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64 } value_type;
static const size_t sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};

typedef struct property {
    value_type type, count; /* count: NO_TYPE unless it is a list */
    int role;               /* where the value goes: below; -1 for nowhere */
} property;

enum { ROLE_X = 0, ROLE_NX = 3, ROLE_U = 6, ROLE_INDICES = 8, ROLES = 9 };

typedef struct element {
    enum { VERTEX, FACE, OTHER } kind;
    uint64_t count;
    property properties[MOST_PROPERTIES];
    size_t property_count;
} element;

typedef struct reader {
    const char *at, *end;
    enum { ASCII, LITTLE, BIG } format;
    size_t line; /* of the header and of ASCII */
    brume_c_locale *locale;
    element elements[MOST_ELEMENTS];
    size_t element_count;
    brume_mesh *mesh;
    size_t triangle_room;
    brume_result result;
    char why[160];
    /* Who is told how far it has come. */
    brume_context *context;
    const char *path, *begin;
} reader;

enum { REPORT_EVERY = 1 << 14 }; /* elements */

static void fail(reader *r, brume_result result, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void fail(reader *r, brume_result result, const char *format, ...) {
    if (r->result != BRUME_OK) return;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(r->why, sizeof r->why, format, arguments);
    va_end(arguments);
    r->result = result;
}

static void fail_short(reader *r) { fail(r, BRUME_ERROR_SCENE, "the file is cut off"); }

/* ---- the header ------------------------------------------------------------------------------------------------ */

/* The next line's words; their number, -1 at the end of the file. What is too long or too much is cut off. */
static int read_words(reader *r, char words[MOST_WORDS][MOST_LETTERS]) {
    const char *stop = memchr(r->at, '\n', (size_t)(r->end - r->at));
    int count = 0;
    if (!stop) return -1;
    r->line++;
    for (const char *c = r->at; c < stop;) {
        while (c < stop && (*c == ' ' || *c == '\t' || *c == '\r')) c++;
        const char *start = c;
        while (c < stop && *c != ' ' && *c != '\t' && *c != '\r') c++;
        size_t length = (size_t)(c - start);
        if (length == 0 || count == MOST_WORDS) continue;
        if (length >= MOST_LETTERS) length = MOST_LETTERS - 1;
        memcpy(words[count], start, length);
        words[count++][length] = 0;
    }
    r->at = stop + 1;
    return count;
}

static value_type type_of(const char *word) {
    static const char *const names[][2] = {{"char", "int8"},   {"uchar", "uint8"}, {"short", "int16"},
                                           {"ushort", "uint16"}, {"int", "int32"},   {"uint", "uint32"},
                                           {"float", "float32"}, {"double", "float64"}};
    for (int i = 0; i < 8; i++)
        if (strcmp(word, names[i][0]) == 0 || strcmp(word, names[i][1]) == 0) return (value_type)(i + 1);
    return NO_TYPE;
}

static int role_of(const element *e, const char *name, int is_list) {
    static const struct { const char *name; int role; } names[] = {
        {"x", ROLE_X}, {"y", ROLE_X + 1}, {"z", ROLE_X + 2}, {"nx", ROLE_NX}, {"ny", ROLE_NX + 1}, {"nz", ROLE_NX + 2},
        {"u", ROLE_U}, {"s", ROLE_U}, {"texture_u", ROLE_U}, {"v", ROLE_U + 1}, {"t", ROLE_U + 1},
        {"texture_v", ROLE_U + 1}};
    if (e->kind == FACE && is_list && (strcmp(name, "vertex_indices") == 0 || strcmp(name, "vertex_index") == 0))
        return ROLE_INDICES;
    for (size_t i = 0; e->kind == VERTEX && !is_list && i < sizeof names / sizeof names[0]; i++)
        if (strcmp(name, names[i].name) == 0) return names[i].role;
    return -1;
}

static void add_element(reader *r, const char *name, const char *count) {
    char *end;
    unsigned long long n = strtoull(count, &end, 10);
    if (*end || !*count || *count == '-' || r->element_count == MOST_ELEMENTS) {
        fail(r, BRUME_ERROR_SCENE, "line %zu: expected a count, and at most %d elements", r->line, MOST_ELEMENTS);
        return;
    }
    element *e = &r->elements[r->element_count++];
    memset(e, 0, sizeof *e);
    e->kind = strcmp(name, "vertex") == 0 ? VERTEX : strcmp(name, "face") == 0 ? FACE : OTHER;
    e->count = n;
}

static void add_property(reader *r, char words[MOST_WORDS][MOST_LETTERS], int count) {
    element *e = r->element_count ? &r->elements[r->element_count - 1] : NULL;
    int is_list = count == 5 && strcmp(words[1], "list") == 0;
    property p = {NO_TYPE, NO_TYPE, -1};
    if (is_list) p.count = type_of(words[2]);
    if (is_list || count == 3) p.type = type_of(words[is_list ? 3 : 1]);
    if (!e || e->property_count == MOST_PROPERTIES || p.type == NO_TYPE ||
        (is_list && (p.count == NO_TYPE || p.count >= FLOAT32))) {
        fail(r, BRUME_ERROR_SCENE, "line %zu: expected a property of a type that PLY knows, and at most %d of them",
             r->line, MOST_PROPERTIES);
        return;
    }
    p.role = role_of(e, words[is_list ? 4 : 2], is_list);
    e->properties[e->property_count++] = p;
}

static void read_header(reader *r) {
    char words[MOST_WORDS][MOST_LETTERS];
    int has_format = 0, count = read_words(r, words);
    if (count != 1 || strcmp(words[0], "ply") != 0) {
        fail(r, BRUME_ERROR_SCENE, "not a readable mesh: a PLY file begins with the line 'ply'");
        return;
    }
    while (r->result == BRUME_OK) {
        count = read_words(r, words);
        if (count < 0) fail_short(r);
        if (count <= 0 || strcmp(words[0], "comment") == 0 || strcmp(words[0], "obj_info") == 0) continue;
        if (strcmp(words[0], "end_header") == 0) break;
        if (strcmp(words[0], "format") == 0 && count == 3) {
            has_format = strcmp(words[2], "1.0") == 0;
            r->format = strcmp(words[1], "binary_little_endian") == 0 ? LITTLE
                        : strcmp(words[1], "binary_big_endian") == 0  ? BIG
                                                                      : ASCII;
            has_format = has_format && (r->format != ASCII || strcmp(words[1], "ascii") == 0);
        } else if (strcmp(words[0], "element") == 0 && count == 3) {
            add_element(r, words[1], words[2]);
        } else if (strcmp(words[0], "property") == 0) {
            add_property(r, words, count);
        } else {
            fail(r, BRUME_ERROR_SCENE, "line %zu: '%s' is not part of a PLY header", r->line, words[0]);
        }
    }
    if (!has_format) fail(r, BRUME_ERROR_SCENE, "not a readable mesh: a PLY of an unknown format");
}

/* ---- values ---------------------------------------------------------------------------------------------------- */

static double read_word(reader *r) {
    char word[MOST_LETTERS];
    size_t length = 0;
    for (; r->at < r->end && strchr(" \t\r\n", *r->at) && *r->at; r->at++) r->line += *r->at == '\n';
    while (r->at < r->end && !strchr(" \t\r\n", *r->at)) {
        if (length == MOST_LETTERS - 1) break;
        word[length++] = *r->at++;
    }
    word[length] = 0;
    if (length == 0 && r->at >= r->end) {
        fail_short(r);
        return 0;
    }
    if (length == 0 || length == MOST_LETTERS - 1 || strspn(word, "+-.0123456789eE") != length ||
        !strpbrk(word, "0123456789")) {
        fail(r, BRUME_ERROR_SCENE, "line %zu: expected a number", r->line);
        return 0;
    }
    return brume_c_locale_strtod(r->locale, word);
}

static double read_value(reader *r, value_type type) {
    unsigned char bytes[8];
    size_t size = sizes[type];
    if (r->format == ASCII) return read_word(r);
    if ((size_t)(r->end - r->at) < size) {
        fail_short(r);
        return 0;
    }
    uint64_t bits = 0;
    memcpy(bytes, r->at, size);
    r->at += size;
    for (size_t i = 0; i < size; i++) bits |= (uint64_t)bytes[r->format == LITTLE ? i : size - 1 - i] << 8 * i;
    uint32_t low = (uint32_t)bits;
    float f;
    double d;
    switch (type) {
    case INT8: return (int8_t)low;
    case INT16: return (int16_t)low;
    case INT32: return (int32_t)low;
    case FLOAT32: memcpy(&f, &low, sizeof f); return f;
    case FLOAT64: memcpy(&d, &bits, sizeof d); return d;
    default: return low;
    }
}

/* ASCII and lists of floats can hold what is no number of things. */
static double read_whole(reader *r, value_type type, const char *what) {
    double value = read_value(r, type);
    if (r->result != BRUME_OK || value == floor(value)) return value;
    if (r->format == ASCII)
        fail(r, BRUME_ERROR_SCENE, "line %zu: expected a whole number for %s", r->line, what);
    else
        fail(r, BRUME_ERROR_SCENE, "expected a whole number for %s", what);
    return 0;
}

/* ---- the elements ---------------------------------------------------------------------------------------------- */

/* Bytes that one of it takes at least: in ASCII a digit and a space for each value. */
static size_t least_size(const reader *r, const element *e) {
    size_t size = 0;
    for (size_t i = 0; i < e->property_count; i++) {
        const property *p = &e->properties[i];
        size += r->format == ASCII ? 2 : sizes[p->count != NO_TYPE ? p->count : p->type];
    }
    return size;
}

static int has_role(const element *e, int role) {
    for (size_t i = 0; i < e->property_count; i++)
        if (e->properties[i].role == role) return 1;
    return 0;
}

static void place_vertex(brume_mesh *m, size_t i, const double values[ROLES]) {
    for (size_t c = 0; c < 3; c++) {
        m->positions[3 * i + c] = (float)values[ROLE_X + c];
        if (m->normals) m->normals[3 * i + c] = (float)values[ROLE_NX + c];
        if (m->uvs && c < 2) m->uvs[2 * i + c] = (float)values[ROLE_U + c];
    }
}

static void add_polygon(reader *r, const uint32_t *corners, size_t count) {
    brume_mesh *m = r->mesh;
    if (count < 3) return;
    if (m->triangle_count + count > r->triangle_room) {
        size_t room = 2 * r->triangle_room + 256;
        uint32_t *grown = room < INT32_MAX / 3 ? realloc(m->triangles, 3 * room * sizeof *grown) : NULL;
        if (!grown) {
            fail(r, BRUME_ERROR_MEMORY, "out of memory");
            return;
        }
        m->triangles = grown;
        r->triangle_room = room;
    }
    m->triangle_count += brume_polygon_cut(corners, count, m->positions, m->triangles + 3 * (size_t)m->triangle_count);
}

static void read_list(reader *r, const property *p) {
    uint32_t corners[BRUME_POLYGON_CORNERS];
    double count = read_whole(r, p->count, "the length of a list");
    int wanted = p->role == ROLE_INDICES;
    if (wanted && !(count >= 0 && count <= BRUME_POLYGON_CORNERS))
        fail(r, BRUME_ERROR_SCENE, "a face has more than %d corners", BRUME_POLYGON_CORNERS);
    if (!(count >= 0)) fail(r, BRUME_ERROR_SCENE, "a list is shorter than nothing");
    for (size_t i = 0; r->result == BRUME_OK && (double)i < count; i++) {
        double value = wanted ? read_whole(r, p->type, "a vertex") : read_value(r, p->type);
        if (!wanted || r->result != BRUME_OK) continue;
        if (!(value >= 0 && value < r->mesh->vertex_count)) {
            fail(r, BRUME_ERROR_SCENE, "a face names a vertex that the file doesn't have");
            return;
        }
        corners[i] = (uint32_t)value;
    }
    if (wanted && r->result == BRUME_OK) add_polygon(r, corners, (size_t)count);
}

static void begin_vertices(reader *r, const element *e) {
    brume_mesh *m = r->mesh;
    int normals = has_role(e, ROLE_NX) && has_role(e, ROLE_NX + 1) && has_role(e, ROLE_NX + 2);
    int uvs = has_role(e, ROLE_U) && has_role(e, ROLE_U + 1);
    if (!has_role(e, ROLE_X) || !has_role(e, ROLE_X + 1) || !has_role(e, ROLE_X + 2) || m->positions)
        fail(r, BRUME_ERROR_SCENE, "expected vertices with x, y and z, once");
    if (e->count > INT32_MAX / 3) fail(r, BRUME_ERROR_SCENE, "the file holds too much");
    if (r->result != BRUME_OK || e->count == 0) return;
    m->vertex_count = (uint32_t)e->count;
    m->positions = malloc(3 * (size_t)e->count * sizeof(float));
    if (normals) m->normals = malloc(3 * (size_t)e->count * sizeof(float));
    if (uvs) m->uvs = malloc(2 * (size_t)e->count * sizeof(float));
    if (!m->positions || (normals && !m->normals) || (uvs && !m->uvs)) fail(r, BRUME_ERROR_MEMORY, "out of memory");
}

static void read_element(reader *r, const element *e) {
    size_t least = least_size(r, e);
    if (least == 0) return;
    /* The last value needs no space behind it. */
    if (e->count > ((uint64_t)(r->end - r->at) + 1) / least) fail_short(r);
    if (r->result == BRUME_OK && e->kind == VERTEX) begin_vertices(r, e);
    for (uint64_t i = 0; i < e->count && r->result == BRUME_OK; i++) {
        if (i % REPORT_EVERY == 0 &&
            !brume_load_goes_on(r->context, r->path, (double)(r->at - r->begin) / (double)(r->end - r->begin)))
            fail(r, BRUME_CANCELLED, "reading was cancelled");
        double values[ROLES] = {0};
        for (size_t k = 0; k < e->property_count && r->result == BRUME_OK; k++) {
            const property *p = &e->properties[k];
            if (p->count != NO_TYPE) {
                read_list(r, p);
                continue;
            }
            double value = read_value(r, p->type);
            if (p->role >= 0) values[p->role] = value;
        }
        if (e->kind == VERTEX && r->result == BRUME_OK) place_vertex(r->mesh, (size_t)i, values);
    }
}

static brume_result parse(reader *r, const char *bytes, size_t size) {
    r->at = r->begin = bytes;
    r->end = bytes + size;
    if (size == 0) fail(r, BRUME_ERROR_SCENE, "the file is empty");
    r->locale = brume_c_locale_create();
    if (!r->locale) fail(r, BRUME_ERROR_MEMORY, "out of memory");
    if (r->result == BRUME_OK) read_header(r);
    for (size_t i = 0; i < r->element_count && r->result == BRUME_OK; i++) read_element(r, &r->elements[i]);
    if (r->mesh->triangle_count == 0) fail(r, BRUME_ERROR_SCENE, "the file holds no triangles");
    brume_c_locale_destroy(r->locale);
    return r->result;
}

brume_result brume_mesh_read_ply(brume_context *context, const char *path, const brume_mesh_options *options,
                                 const char *where, brume_mesh *out) {
    if (!path || !options || !out)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_mesh_read_ply: NULL argument");
    brume_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    size_t size = 0;
    char *bytes = brume_text_read_file(path, &size);
    if (!bytes) return brume_mesh_fail(context, brume_read_error(errno), where, path, strerror(errno));
    reader *r = calloc(1, sizeof *r);
    brume_result result;
    if (r) {
        r->mesh = &mesh;
        r->context = context;
        r->path = path;
        brume_load_begin(context);
        result = parse(r, bytes, size);
        if (result != BRUME_OK) brume_mesh_fail(context, result, where, path, r->why);
    } else {
        result = brume_mesh_fail(context, BRUME_ERROR_MEMORY, where, path, "out of memory");
    }
    free(r);
    free(bytes);
    if (result == BRUME_OK) result = brume_mesh_finish(context, options, where, path, &mesh);
    if (result != BRUME_OK) {
        brume_mesh_free(&mesh);
        return result;
    }
    *out = mesh;
    return BRUME_OK;
}
