/* xml_parameters.h -- scene parameters: $name in attributes, <default>, and the caller's values. */
#ifndef BRUME_XML_PARAMETERS_H
#define BRUME_XML_PARAMETERS_H

#include "xml_tree.h"

typedef struct xml_parameter {
    const char *name, *value;
    size_t length; /* of the name */
    int given;     /* by the caller, so that not using it is a mistake */
    int used;
} xml_parameter;

typedef struct xml_parameters {
    xml_parameter *items; /* malloc */
    size_t count, capacity;
} xml_parameters;

/* Strings are kept, not copied. BRUME_ERROR_MEMORY or BRUME_OK. */
brume_result xml_parameters_add(xml_parameters *parameters, const char *name, const char *value, int given);
xml_parameter *xml_parameters_find(const xml_parameters *parameters, const char *name);
void xml_parameters_free(xml_parameters *parameters);

/* Replaces each $name in `text` by the longest parameter name that fits, and \$ by $. BRUME_ERROR_SCENE for an
 * undefined parameter, whose name is then at *out_unknown with *out_length characters, or for a result that is too long
 * (*out_unknown is NULL). */
brume_result xml_parameters_substitute(xml_parameters *parameters, xml_tree *tree, const char *text, const char **out,
                                       const char **out_unknown, int *out_length);

#endif
