/* xml_tree.c -- the memory of an XML scene file's tree, and where the files are that it names. */
#include "xml_tree.h"

#include "platform.h"

#include <stdlib.h>
#include <string.h>

/* ---- memory ----------------------------------------------------------------------------------------------------- */

typedef struct xml_block {
    struct xml_block *next;
    size_t used, size;
} xml_block;

static size_t align_up(size_t size) { return (size + 15) & ~(size_t)15; }

void *xml_tree_alloc(xml_tree *tree, size_t size) {
    size_t header = align_up(sizeof(xml_block));
    if (size > XML_MAX_BYTES) return NULL;
    size = align_up(size ? size : 1);
    xml_block *block = tree->blocks;
    if (!block || block->size - block->used < size) {
        size_t bytes = size + header > XML_BLOCK_BYTES ? size + header : XML_BLOCK_BYTES;
        if (tree->bytes + bytes > XML_MAX_BYTES) return NULL;
        block = malloc(bytes);
        if (!block) return NULL;
        tree->bytes += bytes;
        *block = (xml_block){tree->blocks, header, bytes};
        tree->blocks = block;
    }
    void *out = (char *)block + block->used;
    block->used += size;
    return out;
}

char *xml_tree_copy(xml_tree *tree, const char *text, size_t length) {
    char *copy = xml_tree_alloc(tree, length + 1);
    if (!copy) return NULL;
    memcpy(copy, text, length);
    copy[length] = '\0';
    return copy;
}

void xml_tree_free(xml_tree *tree) {
    for (xml_block *block = tree->blocks; block;) {
        xml_block *next = block->next;
        free(block);
        block = next;
    }
    *tree = (xml_tree){NULL, 0, NULL};
}

const char *xml_attribute_value(const xml_node *node, const char *name) {
    for (uint32_t i = 0; i < node->attribute_count; i++)
        if (strcmp(node->attributes[i].name, name) == 0) return node->attributes[i].value;
    return NULL;
}

/* ---- places ----------------------------------------------------------------------------------------------------- */

char *xml_tree_join(xml_tree *tree, const char *folder, const char *name) {
    size_t a = strlen(folder), b = strlen(name);
    char *path = xml_tree_alloc(tree, a + b + 1);
    if (!path) return NULL;
    memcpy(path, folder, a);
    memcpy(path + a, name, b + 1);
    return path;
}

const char *xml_tree_resolve(xml_tree *tree, const xml_file *file, const char *name) {
    if (brume_path_is_absolute(name)) return xml_tree_copy(tree, name, strlen(name));
    const char *beside = xml_tree_join(tree, file->folder, name);
    if (!beside) return NULL;
    for (const xml_file *f = file; f; f = f->includer) {
        for (const xml_search *s = f->search; s; s = s->next) {
            const char *path = xml_tree_join(tree, s->folder, name);
            if (!path || brume_path_exists(path)) return path;
        }
        const char *path = f == file ? beside : xml_tree_join(tree, f->folder, name);
        if (!path || brume_path_exists(path)) return path;
    }
    return brume_path_exists(name) ? xml_tree_copy(tree, name, strlen(name)) : beside;
}
