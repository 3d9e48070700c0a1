/* xml_parse.h -- one XML file while expat reads it. Private to xml_parse.c and xml_file.c. */
#ifndef BRUME_XML_PARSE_H
#define BRUME_XML_PARSE_H

#include <expat.h>

#include "xml_parameters.h"
#include "xml_tree.h"

enum { XML_MAX_DEPTH = 100 };

typedef struct xml_reader {
    brume_context *context;
    xml_tree *tree;
    xml_parameters parameters;
    int files;
} xml_reader;

/* One file being parsed. */
typedef struct xml_parse {
    xml_reader *reader;
    XML_Parser expat;
    xml_file *file;
    xml_node *parent; /* of the element to come; NULL before a scene file's root */
    xml_node *stack[XML_MAX_DEPTH];
    int depth;       /* open elements of this file */
    int outer_depth; /* open elements of the files that include it */
    int include_depth;
    int closed_only; /* inside <include>, <default> or <path>, which have no content: their depth */
    const char *closed_tag;
    const char *include_name; /* what <include name="..."> calls the included object */
    brume_result result;
} xml_parse;

/* Keeps the first error and stops expat. */
void xml_fail_at(xml_parse *parse, int line, int column, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
void xml_fail_memory(xml_parse *parse);

void xml_append(xml_node *parent, xml_node *node);

/* Reads a file below `parent`, NULL: as the scene file. `where`: the <include> that asks for it, which is at the depth
 * `outer_depth`, or NULL. */
brume_result xml_parse_file(xml_reader *reader, const char *path, const xml_file *includer, int include_depth,
                            xml_node *parent, int outer_depth, const char *include_name, const xml_node *where);

/* An element that has just begun: the first of its file, or one of those that are the file's own. (xml_file.c) */
void xml_start_root(xml_parse *parse, xml_node *node);
void xml_start_default(xml_parse *parse, const xml_node *node);
void xml_start_path(xml_parse *parse, const xml_node *node);
void xml_start_include(xml_parse *parse, const xml_node *node);

#endif
