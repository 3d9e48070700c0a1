/* xml_tree.h -- an XML scene file as a tree of elements that know where they were written.
 *
 * What belongs to the file rather than to the scene is done here: <include>, <default> and $name, <path>, the version.
 * Which elements and properties mean what is lib/mitsuba_*.
 */
#ifndef BRUME_XML_TREE_H
#define BRUME_XML_TREE_H

#include "context.h"

/* The most that a tree may take, which it takes in blocks of so much. */
#define XML_MAX_BYTES ((size_t)1 << 29)
#define XML_BLOCK_BYTES ((size_t)1 << 16)

/* One file of a scene. */
typedef struct xml_file {
    const char *name;                /* as opened, as errors show it */
    const char *folder;              /* "" or ends in '/' */
    int major, minor;                /* the root's version */
    const struct xml_file *includer; /* NULL for the scene file */
    const struct xml_search *search; /* <path> folders, latest first */
} xml_file;

typedef struct xml_search {
    const char *folder;
    const struct xml_search *next;
} xml_search;

typedef struct xml_attribute {
    const char *name, *value; /* after substitution */
} xml_attribute;

typedef enum xml_mark { XML_UNREAD, XML_READING, XML_READ } xml_mark;

typedef struct xml_node {
    const char *tag;
    const xml_file *file;
    int line, column; /* of its '<', from 1 */
    uint32_t attribute_count;
    xml_attribute *attributes;
    struct xml_node *first, *last, *next; /* children, and the sibling that follows */
    /* For whoever reads the tree: has the element been read (a reference met while READING is circular), and what id
     * did it get in the scene description? */
    xml_mark mark;
    uint32_t id;
} xml_node;

typedef struct xml_tree {
    struct xml_block *blocks; /* everything below lives in these */
    size_t bytes;
    xml_node *root;
} xml_tree;

/* Reads the file and what it includes. Errors: BRUME_ERROR_SCENE, "file:line:column: ...". On failure *out is
 * untouched. `parameters` override the file's <default>s; one that the file never uses is an error. */
brume_result xml_tree_read(brume_context *context, const char *path, const brume_parameter *parameters,
                           size_t parameter_count, xml_tree *out);
void xml_tree_free(xml_tree *tree);

/* NULL if there is none. */
const char *xml_attribute_value(const xml_node *node, const char *name);

/* Memory that lives as long as the tree; NULL when it or the tree's budget runs out. */
void *xml_tree_alloc(xml_tree *tree, size_t size);
char *xml_tree_copy(xml_tree *tree, const char *text, size_t length);
char *xml_tree_join(xml_tree *tree, const char *folder, const char *name);

/* Where the file that `name`, written in `file`, stands for is: in the <path> folders, the folder of `file` and of
 * those that include it, or the working directory. If nowhere, the place next to `file`, so that opening it fails with
 * that name. NULL without memory. */
const char *xml_tree_resolve(xml_tree *tree, const xml_file *file, const char *name);

#endif
