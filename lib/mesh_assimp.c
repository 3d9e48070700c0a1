/* mesh_assimp.c -- PLY, and whatever else assimp reads: all meshes of the file in one, node transforms applied. */
#include <assimp/cimport.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mesh_finish.h"
#include "platform.h"

/* Sums over the nodes: a mesh may be placed several times. */
typedef struct totals {
    uint64_t vertices, triangles;
    int normals, uvs; /* some mesh has them; zeros stand for them in the others */
    int too_deep;
} totals;

/* Deeper trees are broken files, and would cost stack. */
enum { MOST_LEVELS = 1000 };

static void measure(const struct aiScene *scene, const struct aiNode *node, int level, totals *t) {
    for (unsigned i = 0; i < node->mNumMeshes; i++) {
        const struct aiMesh *mesh = scene->mMeshes[node->mMeshes[i]];
        uint64_t triangles = 0;
        /* Points and lines have no surface. */
        for (unsigned f = 0; f < mesh->mNumFaces; f++)
            triangles += mesh->mFaces[f].mNumIndices == 3;
        if (triangles == 0)
            continue;
        t->triangles += triangles;
        t->vertices += mesh->mNumVertices;
        t->normals |= mesh->mNormals != NULL;
        t->uvs |= mesh->mTextureCoords[0] != NULL;
    }
    t->too_deep |= level > MOST_LEVELS;
    for (unsigned i = 0; i < node->mNumChildren && !t->too_deep; i++)
        measure(scene, node->mChildren[i], level + 1, t);
}

static void place_vertices(const struct aiMesh *mesh, const struct aiMatrix4x4 *m, brume_mesh *out) {
    struct aiMatrix3x3 normal_matrix;
    aiMatrix3FromMatrix4(&normal_matrix, m);
    float determinant = aiMatrix3Determinant(&normal_matrix);
    if (determinant != 0) {
        aiMatrix3Inverse(&normal_matrix);
        aiTransposeMatrix3(&normal_matrix);
    }
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        size_t at = (size_t)out->vertex_count + i;
        struct aiVector3D p = mesh->mVertices[i];
        aiTransformVecByMatrix4(&p, m);
        memcpy(out->positions + 3 * at, &p.x, 3 * sizeof(float));
        if (mesh->mNormals) {
            struct aiVector3D n = mesh->mNormals[i];
            aiTransformVecByMatrix3(&n, &normal_matrix);
            memcpy(out->normals + 3 * at, &n.x, 3 * sizeof(float));
        }
        if (mesh->mTextureCoords[0])
            memcpy(out->uvs + 2 * at, &mesh->mTextureCoords[0][i].x, 2 * sizeof(float));
    }
}

static void merge(const struct aiScene *scene, const struct aiNode *node, const struct aiMatrix4x4 *above,
                  brume_mesh *out) {
    struct aiMatrix4x4 here = *above;
    aiMultiplyMatrix4(&here, &node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes; i++) {
        const struct aiMesh *mesh = scene->mMeshes[node->mMeshes[i]];
        uint32_t before = out->triangle_count;
        for (unsigned f = 0; f < mesh->mNumFaces; f++) {
            const struct aiFace *face = &mesh->mFaces[f];
            if (face->mNumIndices != 3)
                continue;
            uint32_t *v = out->triangles + 3 * (size_t)out->triangle_count++;
            for (int k = 0; k < 3; k++) /* an index that would reach into the next mesh is no vertex at all */
                v[k] = face->mIndices[k] < mesh->mNumVertices ? out->vertex_count + face->mIndices[k] : UINT32_MAX;
        }
        if (out->triangle_count == before)
            continue;
        place_vertices(mesh, &here, out);
        out->vertex_count += mesh->mNumVertices;
    }
    for (unsigned i = 0; i < node->mNumChildren; i++)
        merge(scene, node->mChildren[i], &here, out);
}

static brume_result convert(brume_context *context, const struct aiScene *scene, const char *where, const char *path,
                            brume_mesh *mesh) {
    totals t = {0, 0, 0, 0, 0};
    measure(scene, scene->mRootNode, 0, &t);
    if (t.too_deep || t.vertices > INT32_MAX / 3 || t.triangles > INT32_MAX / 3)
        return brume_mesh_fail(context, BRUME_ERROR_SCENE, where, path, "the file holds too much");
    if (t.triangles == 0)
        return brume_mesh_fail(context, BRUME_ERROR_SCENE, where, path, "the file holds no triangles");
    mesh->positions = malloc(3 * t.vertices * sizeof *mesh->positions);
    mesh->triangles = malloc(3 * t.triangles * sizeof *mesh->triangles);
    if (t.normals)
        mesh->normals = calloc(3 * t.vertices, sizeof *mesh->normals);
    if (t.uvs)
        mesh->uvs = calloc(2 * t.vertices, sizeof *mesh->uvs);
    if (!mesh->positions || !mesh->triangles || (t.normals && !mesh->normals) || (t.uvs && !mesh->uvs))
        return brume_mesh_fail(context, BRUME_ERROR_MEMORY, where, path, "out of memory");
    struct aiMatrix4x4 identity;
    aiIdentityMatrix4(&identity);
    merge(scene, scene->mRootNode, &identity, mesh);
    return BRUME_OK;
}

/* assimp's own words, on one line, for a file that can be opened but not read. It catches all exceptions: one that it
 * has no words for comes from an allocation, like those of that name. */
static brume_result explain(const char *path, int error, char why[256]) {
    const char *words = aiGetErrorString();
    if (error == ENOMEM || strcmp(words, "") == 0 || strstr(words, "bad_alloc") || strstr(words, "Unknown exception")) {
        snprintf(why, 256, "out of memory");
        return BRUME_ERROR_MEMORY;
    }
    FILE *file = fopen(path, "rb");
    int empty = file && fgetc(file) == EOF;
    if (!file || ferror(file) || empty) {
        snprintf(why, 256, "%s", file && empty && !ferror(file) ? "the file is empty" : strerror(errno));
    } else {
        snprintf(why, 256, "not a readable mesh: %.200s", words);
        for (char *c = why; *c; c++)
            if (*c == '\n' || *c == '\r')
                *c = ' ';
    }
    brume_result result = file ? BRUME_ERROR_SCENE : brume_read_error(errno);
    if (file)
        fclose(file);
    return result;
}

/* assimp keeps the words of the last failure in a string of the whole process, which every failing import writes:
 * without the lock, contexts in two threads would not be independent. */
static brume_lock import_lock = BRUME_LOCK_INIT;

/* NULL after a failure, with what that is in *result and the reason in `why`. */
static const struct aiScene *import(const char *path, brume_result *result, char why[256]) {
    brume_lock_exclusive(&import_lock);
    errno = 0;
    const struct aiScene *scene = aiImportFile(path, aiProcess_Triangulate);
    if (!scene || !scene->mRootNode) {
        *result = explain(path, errno, why);
        aiReleaseImport(scene);
        scene = NULL;
    }
    brume_unlock_exclusive(&import_lock);
    return scene;
}

brume_result brume_mesh_read_ply(brume_context *context, const char *path, const brume_mesh_options *options,
                                 const char *where, brume_mesh *out) {
    brume_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    if (!path || !options || !out)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_mesh_read_ply: NULL argument");
    char why[256];
    brume_result result = BRUME_OK;
    const struct aiScene *scene = import(path, &result, why);
    if (!scene)
        return brume_mesh_fail(context, result, where, path, why);
    result = convert(context, scene, where, path, &mesh);
    aiReleaseImport(scene);
    if (result == BRUME_OK)
        result = brume_mesh_finish(context, options, where, path, &mesh);
    if (result != BRUME_OK) {
        brume_mesh_free(&mesh);
        return result;
    }
    *out = mesh;
    return BRUME_OK;
}
