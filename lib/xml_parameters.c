/* xml_parameters.c -- substitution of $name in scene files. */
#include "xml_parameters.h"

#include <stdlib.h>
#include <string.h>

/* Defaults may refer to each other, so a few lines could ask for gigabytes. */
#define MAX_VALUE ((size_t)1 << 20)

brume_result xml_parameters_add(xml_parameters *parameters, const char *name, const char *value, int given) {
    if (parameters->count == parameters->capacity) {
        size_t capacity = parameters->capacity ? 2 * parameters->capacity : 16;
        xml_parameter *items = realloc(parameters->items, capacity * sizeof *items);
        if (!items) return BRUME_ERROR_MEMORY;
        parameters->items = items;
        parameters->capacity = capacity;
    }
    parameters->items[parameters->count++] = (xml_parameter){name, value, strlen(name), given, 0};
    return BRUME_OK;
}

xml_parameter *xml_parameters_find(const xml_parameters *parameters, const char *name) {
    for (size_t i = 0; i < parameters->count; i++)
        if (strcmp(parameters->items[i].name, name) == 0) return &parameters->items[i];
    return NULL;
}

void xml_parameters_free(xml_parameters *parameters) {
    free(parameters->items);
    *parameters = (xml_parameters){NULL, 0, 0};
}

static xml_parameter *longest_match(const xml_parameters *parameters, const char *text) {
    xml_parameter *best = NULL;
    for (size_t i = 0; i < parameters->count; i++) {
        xml_parameter *p = &parameters->items[i];
        if (strncmp(text, p->name, p->length) == 0 && (!best || p->length > best->length)) best = p;
    }
    return best;
}

static int name_length(const char *text) {
    int n = 0;
    while (n < 64 && ((text[n] >= 'a' && text[n] <= 'z') || (text[n] >= 'A' && text[n] <= 'Z') ||
                      (text[n] >= '0' && text[n] <= '9') || text[n] == '_'))
        n++;
    return n;
}

/* Writes to `out` unless it is NULL; *length is the size either way. */
static brume_result expand(xml_parameters *parameters, const char *text, char *out, size_t *length,
                           const char **unknown) {
    size_t n = 0;
    for (const char *c = text; *c;) {
        const char *piece = c;
        size_t piece_length = 1;
        if (c[0] == '\\' && c[1] == '$') {
            piece = c + 1;
            c += 2;
        } else if (c[0] == '$') {
            xml_parameter *p = longest_match(parameters, c + 1);
            if (!p) {
                *unknown = c + 1;
                return BRUME_ERROR_SCENE;
            }
            p->used = 1;
            piece = p->value;
            piece_length = strlen(p->value);
            c += 1 + p->length;
        } else {
            c++;
        }
        if (out) memcpy(out + n, piece, piece_length);
        n += piece_length;
        if (n > MAX_VALUE) {
            *unknown = NULL;
            return BRUME_ERROR_SCENE;
        }
    }
    *length = n;
    return BRUME_OK;
}

brume_result xml_parameters_substitute(xml_parameters *parameters, xml_tree *tree, const char *text, const char **out,
                                       const char **out_unknown, int *out_length) {
    size_t length = 0;
    brume_result result = expand(parameters, text, NULL, &length, out_unknown);
    if (result != BRUME_OK) {
        if (*out_unknown) *out_length = name_length(*out_unknown);
        return result;
    }
    char *copy = xml_tree_alloc(tree, length + 1);
    if (!copy) return BRUME_ERROR_MEMORY;
    expand(parameters, text, copy, &length, out_unknown);
    copy[length] = '\0';
    *out = copy;
    return BRUME_OK;
}
