/* mitsuba_shapes.c -- obj, ply, rectangle, cube, sphere, disk, with what is nested in them. */
#include "mesh.h"
#include "mitsuba.h"

#include <string.h>

static void read_mesh(mitsuba_object *o, brume_shape_desc *desc, brume_mesh *mesh) {
    int is_obj = mitsuba_is(o, "obj");
    const char *filename = mitsuba_string(o, "filename", NULL);
    brume_mesh_options options = {mitsuba_boolean(o, "face_normals", 0), mitsuba_boolean(o, "flip_tex_coords", is_obj)};
    mitsuba_require(o, "filename", filename && *filename, "name a mesh");
    mitsuba_close(o); /* before the time it takes to read a mesh */
    const char *where, *path = mitsuba_path(o, filename, &where);
    if (!path) return;
    mitsuba_keep(o->reader, o->node,
                 (is_obj ? brume_mesh_read_obj : brume_mesh_read_ply)(o->reader->context, path, &options, where, mesh));
    desc->vertex_count = mesh->vertex_count;
    desc->triangle_count = mesh->triangle_count;
    desc->positions = mesh->positions;
    desc->normals = mesh->normals;
    desc->uvs = mesh->uvs;
    desc->triangles = mesh->triangles;
}

static void read_sphere(mitsuba_object *o, brume_shape_desc *desc) {
    double center[3];
    if (mitsuba_vector(o, "center", center))
        for (int i = 0; i < 3; i++) desc->center[i] = (float)center[i];
    desc->radius = mitsuba_float(o, "radius", 1.0);
    mitsuba_require(o, "radius", desc->radius > 0.0f, "be positive");
}

static uint32_t read_medium(mitsuba_object *o, const char *name) {
    xml_node *medium = mitsuba_object_of(o, name, "medium");
    return medium ? mitsuba_read_medium(o->reader, medium) : BRUME_NONE;
}

static void read_nested(mitsuba_object *o, brume_shape_desc *desc) {
    desc->interior = read_medium(o, "interior");
    desc->exterior = read_medium(o, "exterior");
    desc->is_boundary = desc->interior != BRUME_NONE || desc->exterior != BRUME_NONE;
    const mitsuba_property *p = mitsuba_child(o, "bsdf");
    if (p) desc->bsdf = mitsuba_read_bsdf(o->reader, p->object);
    if ((p = mitsuba_child(o, "bsdf"))) mitsuba_fail(o->reader, p->node, "a shape has at most one <bsdf>");
    p = mitsuba_child(o, "emitter");
    if (p) mitsuba_read_area(o->reader, p->object, desc->radiance);
    if ((p = mitsuba_child(o, "emitter"))) mitsuba_fail(o->reader, p->node, "a shape has at most one <emitter>");
    if ((p = mitsuba_child(o, "medium")))
        mitsuba_fail(o->reader, p->node, "a medium of a shape must be named interior or exterior");
}

void mitsuba_read_shape(mitsuba_reader *reader, xml_node *node) {
    brume_mesh mesh = {0, 0, NULL, NULL, NULL, NULL};
    mitsuba_object o = mitsuba_open(reader, node);
    brume_shape_kind kind = mitsuba_is(&o, "rectangle") ? BRUME_SHAPE_RECTANGLE
                            : mitsuba_is(&o, "cube")    ? BRUME_SHAPE_CUBE
                            : mitsuba_is(&o, "sphere")  ? BRUME_SHAPE_SPHERE
                            : mitsuba_is(&o, "disk")    ? BRUME_SHAPE_DISK
                                                        : BRUME_SHAPE_MESH;
    brume_shape_desc desc = brume_shape_desc_default(kind);
    mitsuba_to_world(&o, desc.to_world);
    desc.flip_normals = (uint32_t)mitsuba_boolean(&o, "flip_normals", 0);
    read_nested(&o, &desc);
    if (kind == BRUME_SHAPE_SPHERE) read_sphere(&o, &desc);
    if (kind == BRUME_SHAPE_MESH) read_mesh(&o, &desc, &mesh);
    mitsuba_close(&o);
    uint32_t id = BRUME_NONE;
    if (reader->result == BRUME_OK) mitsuba_keep(reader, node, brume_scene_add_shape(reader->scene, &desc, &id));
    mitsuba_note(reader, node, BRUME_OBJECT_SHAPE, id);
    brume_mesh_free(&mesh);
}
