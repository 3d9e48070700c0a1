/* path.cl -- the entry point: samples of a tile of pixels, one path per lane. */
#include "path.h"

#ifndef LOCAL_SIZE
#define LOCAL_SIZE 1
#endif

/* So many lanes may idle before new samples start in them: starting costs all lanes the time of one camera ray. */
#define MAX_IDLE (LANES / 8)

/* The film is laid out for programs of this width; narrower ones may render into it, a part of a tile each, and give
 * the same bits. */
#ifndef LAYOUT_LANES
#define LAYOUT_LANES LANES
#endif
#define TILE_WIDTH (LAYOUT_LANES >= 8 ? 4 : LAYOUT_LANES >= 4 ? 2 : 1)

/* A NaN or an infinity in what the path found, or in what it ended with: that may have been lost on the way, as a ray
 * without a direction meets nothing, and no comparison with it holds. */
FN mask path_is_broken(const path *p) {
    mask radiance = is_bad(p->radiance.r) | is_bad(p->radiance.g) | is_bad(p->radiance.b);
    mask throughput = is_bad(p->throughput.r) | is_bad(p->throughput.g) | is_bad(p->throughput.b);
    return radiance | throughput | is_bad(p->d.x) | is_bad(p->d.y) | is_bad(p->d.z);
}

/* The parts of the light, cut as the whole is. */
FN void finish_layers(film *f, const path *p, real most, mask good) {
    const light_layers *l = &p->layers;
    rgb cut;
    cut.r = p->radiance.r > most ? most / p->radiance.r : R(1);
    cut.g = p->radiance.g > most ? most / p->radiance.g : R(1);
    cut.b = p->radiance.b > most ? most / p->radiance.b : R(1);
    cut = cscale(cut, p->sign);
    film_add_rgb(f, FILM_SURFACE_DIRECT, cmul(l->surface_direct, cut), good);
    film_add_rgb(f, FILM_SURFACE_INDIRECT, cmul(l->surface_indirect, cut), good);
    film_add_rgb(f, FILM_VOLUME_DIRECT, cmul(l->volume_direct, cut), good);
    film_add_rgb(f, FILM_VOLUME_INDIRECT, cmul(l->volume_indirect, cut), good);
    film_add_dithered(f, FILM_SEGMENTS, l->segments, good);
}

/* What it met first. */
FN void finish_guides(film *f, const path *p, mask good) {
    mask hit = good & p->guide.hit;
    film_add_plain(f, FILM_ALPHA, R(1), good & p->met);
    film_add_rgb(f, FILM_ALBEDO_R, p->guide.albedo, hit);
    film_add_dithered(f, FILM_NORMAL_X, p->guide.n.x, hit);
    film_add_dithered(f, FILM_NORMAL_Y, p->guide.n.y, hit);
    film_add_dithered(f, FILM_NORMAL_Z, p->guide.n.z, hit);
    film_add_dithered(f, FILM_DEPTH, p->guide.depth, hit);
    film_add_plain(f, FILM_HIT_COUNT, R(1), hit);
}

/* Adds finished paths to the film. */
FN void finish_paths(film *f, const path *p, real most, __global uint *bad, ireal pixel, ureal32 sample,
                     mask finished) {
    mask broken = finished & path_is_broken(p);
    if (ANY(broken)) {
        lanes_of_ireal is, at, index;
        is.all = broken ? I(1) : I(0);
        at.all = pixel;
        index.all = to_ireal(sample);
        EACH_LANE(k) {
            if (is.one[k] && atomic_inc(&bad[BAD_COUNT]) == 0) {
                bad[BAD_PIXEL] = (uint)at.one[k];
                bad[BAD_SAMPLE] = (uint)index.one[k];
            }
        }
    }
    mask good = finished & !broken;
    rgb x = p->radiance;
    x.r = lmin(x.r, most);
    x.g = lmin(x.g, most);
    x.b = lmin(x.b, most);
    x = cscale(x, p->sign);
    film_dither(f, random_of_film(&p->random));
    film_add(f, FILM_SUM_R, FILM_REST_R, x.r, good);
    film_add(f, FILM_SUM_G, FILM_REST_G, x.g, good);
    film_add(f, FILM_SUM_B, FILM_REST_B, x.b, good);
    film_add_dithered(f, FILM_SQUARE_R, square(x.r), good);
    film_add_dithered(f, FILM_SQUARE_G, square(x.g), good);
    film_add_dithered(f, FILM_SQUARE_B, square(x.b), good);
    film_add_plain(f, FILM_COUNT, R(1), good);
    if (HAS(GUIDES)) finish_guides(f, p, good);
    if (HAS(LIGHT_LAYERS)) finish_layers(f, p, most, good);
}

/* `samples` samples of each pixel of a group from `first_sample` on.
 *
 * LAUNCH_PILOT: looks along one camera ray of each pixel, writes the plan, and adds nothing to the film.
 * LAUNCH_ADAPTIVE: of those pixels whose slots the schedule holds, LANES to a group; below 0 stands for none.
 * LAUNCH_CHOSEN: they have more error than others; the plan is taken accordingly.
 *
 * A call, because PoCL makes three functions of a kernel (with and without work-group loops), each with the kernel's
 * whole body inlined: the machine code was generated three times over. */
CALL void render_tile(SCENE_PARAMETERS, __global float *planes, __global uint *bad, __global uchar *plan,
                      __global const int *schedule, uint group, uint first_sample, uint samples, uint launch
                      TRACE_PARAMETER) {
    SCENE_FROM_PARAMETERS(s);
    TRACE_INTO(s);

    uint tiles_x = ((uint)params->crop_width + TILE_WIDTH - 1) / TILE_WIDTH;
    uint tile_height = LAYOUT_LANES / TILE_WIDTH;
    uint tiles_y = ((uint)params->crop_height + tile_height - 1) / tile_height;
    uint tiles = tiles_x * tiles_y;
    film f;
    f.planes = planes;
    f.slots = (size_t)tiles * LAYOUT_LANES;
    f.slot = I(group * LANES) + lane_index();
    if (launch & LAUNCH_ADAPTIVE) f.slot = gather_int(schedule, f.slot);
    mask inside = f.slot >= I(0);
    ireal slot = inside ? f.slot : I(0), tile = slot / I(LAYOUT_LANES), place = slot % I(LAYOUT_LANES);
    ireal in_x = tile % I(tiles_x) * I(TILE_WIDTH) + place % I(TILE_WIDTH);
    ireal in_y = tile / I(tiles_x) * I(tile_height) + place / I(TILE_WIDTH);
    inside = inside & (in_x < I(params->crop_width)) & (in_y < I(params->crop_height));
    ireal x = in_x + I(params->crop_x), y = in_y + I(params->crop_y);

    s.plan = plan;
    s.plan_stride = f.slots;
    s.plan_slot = slot;
    s.is_pilot = (launch & LAUNCH_PILOT) != 0;
    s.is_chosen = (launch & LAUNCH_CHOSEN) != 0;

    film_load(&f);
    ireal started = I(0);
    path p = path_none();
    for (ulong steps = (ulong)samples * LANES * MAX_SEGMENTS; steps > 0; steps--) {
        mask idle = inside & !p.alive & (started < I(samples));
        if (ANY(idle) && (!ANY(p.alive) || count_lanes(idle) > MAX_IDLE)) {
            path fresh = path_start(&s, x, y, U32(first_sample) + to_ureal32(started), idle);
            p = path_select(idle, fresh, p);
            started = idle ? started + I(1) : started;
        }
        mask before = p.alive;
        if (!ANY(before)) break;
        path_step(&s, &p);
        if (s.is_pilot) break;
        mask finished = before & !p.alive;
        if (ANY(finished))
            finish_paths(&f, &p, R(params->clamp), bad, y * I(params->width) + x,
                         U32(first_sample) + to_ureal32(started) - U32(1), finished);
    }
    if (!s.is_pilot) film_store(&f);
}

/* The lanes are vectors already: without the hint, Intel's runtime widens them once more.
 *
 * Groups group_begin ... group_end - 1 of LANES pixels, `samples` samples of each from `first_sample` on. One work-item
 * a group, which is a tile of the film unless that is laid out for a wider program. */
__kernel __attribute__((reqd_work_group_size(LOCAL_SIZE, 1, 1))) __attribute__((vec_type_hint(real)))
void render_paths(SCENE_PARAMETERS, __global float *planes, __global uint *bad, __global uchar *plan,
                  __global const int *schedule, uint group_begin, uint group_end, uint first_sample, uint samples,
                  uint launch TRACE_PARAMETER) {
    uint group = group_begin + (uint)get_global_id(0);
    if (group < group_end)
        render_tile(SCENE_ARGUMENTS, planes, bad, plan, schedule, group, first_sample, samples, launch TRACE_ARGUMENT);
}
