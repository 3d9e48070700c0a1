/* sample_pairs.c -- see sample_pairs.h. */
#include "sample_pairs.h"

#include <math.h>
#include <string.h>

enum { MOST = SAMPLE_PAIRS_SIDE * SAMPLE_PAIRS_SIDE };

static brume_result render_sample(const brume_scene *scene, const sample_maker *maker, const uint32_t crop[4],
                                  uint32_t sample, float *out, uint64_t *bad) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    brume_render_stats stats;
    desc.precision = maker->precision;
    desc.lanes = maker->lanes;
    desc.guides = 0;
    desc.error_estimate = 0;
    desc.first_sample = sample;
    desc.sample_count = 1;
    desc.use_crop = 1;
    desc.crop_x = crop[0];
    desc.crop_y = crop[1];
    desc.crop_width = crop[2];
    desc.crop_height = crop[3];
    brume_result result = brume_render_create(maker->device, scene, &desc, &render);
    if (result != BRUME_OK) return result;
    result = brume_render_run(render, NULL, NULL);
    if (result == BRUME_OK)
        result = brume_render_read(render, BRUME_CHANNEL_RADIANCE, out, (size_t)crop[2] * crop[3] * 3);
    if (result == BRUME_OK) result = brume_render_get_stats(render, &stats);
    if (result == BRUME_OK) *bad += stats.bad_samples;
    brume_render_destroy(render);
    return result;
}

static void compare_one(sample_pairs *p, const float a[3], const float b[3], uint32_t x, uint32_t y, uint32_t sample) {
    double off = 0;
    for (int c = 0; c < 3; c++) {
        double difference = fabs((double)a[c] - b[c]);
        if (difference > 0) off = fmax(off, difference / fmax(fabs(a[c]), fabs(b[c])));
        p->mean += b[c];
        if (difference > p->worst) {
            p->worst = difference;
            p->worst_x = x;
            p->worst_y = y;
            p->worst_sample = sample;
        }
    }
    p->count++;
    p->different += memcmp(a, b, 3 * sizeof *a) != 0;
    for (int level = 0; level < SAMPLE_PAIRS_LEVELS; level++) p->above[level] += off > pow(10, level - 5);
}

sample_pairs sample_pairs_compare(brume_context *context, const brume_scene *scene, const sample_maker makers[2],
                                  uint32_t samples) {
    static float a[MOST * 3], b[MOST * 3];
    sample_pairs p;
    brume_film_desc film;
    memset(&p, 0, sizeof p);
    if (brume_scene_get_film(scene, &film) != BRUME_OK) p.message = brume_context_message(context);
    uint32_t crop[4];
    crop[2] = film.width < SAMPLE_PAIRS_SIDE ? film.width : SAMPLE_PAIRS_SIDE;
    crop[3] = film.height < SAMPLE_PAIRS_SIDE ? film.height : SAMPLE_PAIRS_SIDE;
    crop[0] = (film.width - crop[2]) / 2;
    crop[1] = (film.height - crop[3]) / 2;
    for (uint32_t s = 0; s < samples && !p.message; s++) {
        if (render_sample(scene, &makers[0], crop, s, a, &p.bad) != BRUME_OK ||
            render_sample(scene, &makers[1], crop, s, b, &p.bad) != BRUME_OK) {
            p.message = brume_context_message(context);
            break;
        }
        for (uint32_t i = 0; i < crop[2] * crop[3]; i++)
            compare_one(&p, a + 3 * i, b + 3 * i, crop[0] + i % crop[2], crop[1] + i / crop[2], s);
    }
    p.mean /= 3.0 * (p.count ? p.count : 1);
    return p;
}
