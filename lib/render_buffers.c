/* render_buffers.c -- what a render keeps on the device: whether there is room, the scene's arrays, the film. */
#include <stdio.h>

#include "render.h"

enum { FILM_BUFFERS = 4, ALL_BUFFERS = BRUME_SCENE_BUFFERS + FILM_BUFFERS };

typedef struct part { const void *data; size_t size; } part;

/* In the order of SCENE_PARAMETERS in cl/scene.h. OpenCL has no empty buffers: what is empty is some zeros. */
static void scene_parts(const brume_arrays *a, part parts[BRUME_SCENE_BUFFERS]) {
    static const char nothing[256];
    const part all[BRUME_SCENE_BUFFERS] = {
        {&a->params, sizeof a->params},
        {a->bvh.nodes, a->bvh.node_count * sizeof *a->bvh.nodes},
        {a->bvh.blocks, a->bvh.block_count * sizeof *a->bvh.blocks},
        {a->bvh.quadric_ids, a->bvh.quadric_block_count * 8 * sizeof *a->bvh.quadric_ids},
        {a->quadrics, (size_t)a->params.quadric_count * sizeof *a->quadrics},
        {a->triangles, (size_t)a->params.triangle_count * sizeof *a->triangles},
        {a->positions, (size_t)a->position_count * 3 * sizeof(float)},
        {a->normals, (size_t)a->normal_count * 3 * sizeof(float)},
        {a->uvs, (size_t)a->uv_count * 2 * sizeof(float)},
        {a->shapes, a->shape_count * sizeof *a->shapes},
        {a->bsdfs, a->bsdf_count * sizeof *a->bsdfs},
        {a->textures, a->texture_count * sizeof *a->textures},
        {a->texels, (size_t)a->texel_count * 3 * sizeof(float)},
        {a->media, a->medium_count * sizeof *a->media},
        {a->lights, a->light_count * sizeof *a->lights},
        {a->emitters, a->emitter_count * sizeof *a->emitters},
        {a->cdf, a->cdf_count * sizeof(float)},
        {a->filter, a->filter_count * sizeof(float)},
        {a->light_tree.blocks, a->light_tree.block_count * sizeof *a->light_tree.blocks},
    };
    for (int i = 0; i < BRUME_SCENE_BUFFERS; i++) {
        parts[i] = all[i];
        if (parts[i].size == 0) parts[i] = (part){nothing, sizeof nothing};
    }
}

static const char *const names[ALL_BUFFERS] = {
    "parameters", "hierarchy", "triangles in the hierarchy", "quadrics in the hierarchy", "quadrics", "triangles",
    "positions", "normals", "texture coordinates", "shapes", "materials", "textures", "texels", "media", "lights",
    "emitters", "tables of probabilities", "filter", "light tree", "film", "bad samples", "plan", "schedule"};

/* Planes, bad, plan, schedule. Nobody looks at the plan without a pilot, nor at the schedule while all pixels are
 * alike. */
static void film_sizes(const brume_render *render, size_t sizes[FILM_BUFFERS]) {
    size_t slots = brume_film_slot_count(&render->layout);
    size_t planes = brume_film_plane_count(brume_render_recorded(render));
    size_t schedule = brume_goal_exists(render) ? slots : 1;
    sizes[0] = planes * slots * sizeof(float);
    sizes[1] = BAD_SIZE * sizeof(cl_uint);
    sizes[2] = render->needs_pilot ? EVERY_LAMP * slots : 1;
    sizes[3] = schedule * sizeof(cl_int);
}

/* "1.5 GiB" */
static const char *bytes_text(double bytes, char text[24]) {
    static const char *const units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    int unit = 0;
    for (; bytes >= 1024 && unit < 4; unit++) bytes /= 1024;
    snprintf(text, 24, bytes < 100 && unit > 0 ? "%.1f %s" : "%.0f %s", bytes, units[unit]);
    return text;
}

static brume_result check_room(const brume_render *render, const size_t sizes[ALL_BUFFERS], cl_int code) {
    const brume_device *device = render->device;
    uint64_t total = 0;
    int largest = 0;
    char need[24], have[24], part_need[24], part_most[24];
    for (int i = 0; i < ALL_BUFFERS; i++) {
        total += sizes[i];
        if (sizes[i] > sizes[largest]) largest = i;
    }
    bytes_text((double)total, need);
    bytes_text((double)device->info.memory_bytes, have);
    bytes_text((double)sizes[largest], part_need);
    bytes_text((double)device->largest_buffer, part_most);
    if (device->largest_buffer && sizes[largest] > device->largest_buffer)
        return brume_fail(device->context, BRUME_ERROR_MEMORY,
                          "the scene and its picture need %s of memory on the device, %s of it in one piece for the "
                          "%s; %s has %s, and gives at most %s at once",
                          need, part_need, names[largest], device->info.name, have, part_most);
    if (device->info.memory_bytes && total > device->info.memory_bytes)
        return brume_fail(device->context, BRUME_ERROR_MEMORY,
                          "the scene and its picture need %s of memory on the device, %s of it for the %s; %s has %s",
                          need, part_need, names[largest], device->info.name, have);
    if (code != CL_SUCCESS)
        return brume_fail(device->context, BRUME_ERROR_MEMORY,
                          "the scene and its picture need %s of memory on the device, and %s, which has %s in all, "
                          "does not have so much left: %s (%d)",
                          need, device->info.name, have, brume_cl_error_name(code), (int)code);
    return BRUME_OK;
}

/* Of zeros. */
static cl_int create_film_buffer(brume_render *render, size_t size, cl_mem *out) {
    cl_int code;
    cl_uchar zero = 0;
    *out = clCreateBuffer(render->device->cl, CL_MEM_READ_WRITE, size, NULL, &code);
    if (code != CL_SUCCESS) *out = NULL;
    return code == CL_SUCCESS ? clEnqueueFillBuffer(render->device->queue, *out, &zero, 1, 0, size, 0, NULL, NULL)
                              : code;
}

brume_result brume_render_create_buffers(brume_render *render, const brume_arrays *arrays) {
    brume_device *device = render->device;
    part parts[BRUME_SCENE_BUFFERS];
    size_t sizes[ALL_BUFFERS];
    cl_int code = CL_SUCCESS;
    cl_mem *film[FILM_BUFFERS] = {&render->planes, &render->bad, &render->plan, &render->schedule};
    scene_parts(arrays, parts);
    for (int i = 0; i < BRUME_SCENE_BUFFERS; i++) sizes[i] = parts[i].size;
    film_sizes(render, sizes + BRUME_SCENE_BUFFERS);
    BRUME_TRY(check_room(render, sizes, CL_SUCCESS));
    for (int i = 0; i < BRUME_SCENE_BUFFERS && code == CL_SUCCESS; i++) {
        cl_mem buffer = clCreateBuffer(device->cl, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, parts[i].size,
                                       (void *)(size_t)parts[i].data, &code);
        if (code == CL_SUCCESS) render->buffers[i] = buffer;
    }
    for (int i = 0; i < FILM_BUFFERS && code == CL_SUCCESS; i++)
        code = create_film_buffer(render, sizes[BRUME_SCENE_BUFFERS + i], film[i]);
    if (code == CL_SUCCESS && render->traced)
        code = create_film_buffer(render, TRACE_ROOM * sizeof(b_trace_vertex), &render->trace);
    if (code == CL_SUCCESS) code = clFinish(device->queue);
    for (int i = 0; i < ALL_BUFFERS; i++) render->stats.device_bytes += sizes[i];
    if (code == CL_MEM_OBJECT_ALLOCATION_FAILURE) return check_room(render, sizes, code);
    return code == CL_SUCCESS ? BRUME_OK : brume_fail_cl(device->context, code, "uploading the scene");
}
