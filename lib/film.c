/* film.c -- see film.h. */
#include "film.h"

#include <float.h>
#include <math.h>

#include "../cl/shared.h"

brume_film_layout brume_film_layout_make(uint32_t width, uint32_t height, uint32_t lanes) {
    brume_film_layout l = {.width = width, .height = height};
    l.tile_width = lanes >= 8 ? 4 : lanes >= 4 ? 2 : 1;
    l.tile_height = lanes / l.tile_width;
    l.tiles_x = (width + l.tile_width - 1) / l.tile_width;
    l.group_count = l.tiles_x * ((height + l.tile_height - 1) / l.tile_height);
    return l;
}

size_t brume_film_slot_count(const brume_film_layout *l) {
    return (size_t)l->group_count * l->tile_width * l->tile_height;
}

size_t brume_film_slot_of(const brume_film_layout *l, uint32_t x, uint32_t y) {
    size_t group = (size_t)(y / l->tile_height) * l->tiles_x + x / l->tile_width;
    return group * l->tile_width * l->tile_height + (y % l->tile_height) * l->tile_width + x % l->tile_width;
}

size_t brume_film_plane_count(uint32_t recorded) {
    return recorded == 0 ? FILM_PLANES : recorded == 1 ? FILM_GUIDE_PLANES : FILM_LAYER_PLANES;
}

/* Variance of the mean of n samples: (sum of squares - n mean^2) / (n (n - 1)). */
static double variance_of_mean(double sum, double squares, double n) {
    if (n < 2) return 0;
    double spread = squares - sum * sum / n;
    return spread > 0 ? spread / (n * (n - 1)) : 0;
}

void brume_film_resolve(const brume_film_layout *l, const float *planes, float filter_weight, brume_channel channel,
                        float *out) {
    size_t slots = brume_film_slot_count(l);
    for (uint32_t y = 0; y < l->height; y++) {
        for (uint32_t x = 0; x < l->width; x++) {
            const float *at = planes + brume_film_slot_of(l, x, y);
#define PLANE(k) ((double)at[(size_t)(k) * slots])
#define PARTS(a, b) for (int c = 0; c < 3; c++) *out++ = (float)(w * scale * (PLANE((a) + c) + PLANE((b) + c)));
            double n = PLANE(FILM_COUNT), w = filter_weight, scale = n > 0 ? 1 / n : 0;
            switch (channel) {
            case BRUME_CHANNEL_RADIANCE:
                for (int c = 0; c < 3; c++)
                    *out++ = (float)(w * scale * (PLANE(FILM_SUM_R + c) + PLANE(FILM_REST_R + c)));
                break;
            case BRUME_CHANNEL_VARIANCE:
                for (int c = 0; c < 3; c++)
                    *out++ = (float)(w * w * variance_of_mean(PLANE(FILM_SUM_R + c) + PLANE(FILM_REST_R + c),
                                                              PLANE(FILM_SQUARE_R + c), n));
                break;
            case BRUME_CHANNEL_ALBEDO:
                for (int c = 0; c < 3; c++) *out++ = (float)(scale * PLANE(FILM_ALBEDO_R + c));
                break;
            case BRUME_CHANNEL_NORMAL:
                for (int c = 0; c < 3; c++) *out++ = (float)(scale * PLANE(FILM_NORMAL_X + c));
                break;
            case BRUME_CHANNEL_DEPTH: {
                double hits = PLANE(FILM_HIT_COUNT);
                *out++ = (float)(hits > 0 ? PLANE(FILM_DEPTH) / hits : 0);
                break;
            }
            case BRUME_CHANNEL_ERROR:
            case BRUME_CHANNEL_BAD_SAMPLES: break; /* not the film's to know */
            case BRUME_CHANNEL_DIRECT: PARTS(FILM_SURFACE_DIRECT, FILM_VOLUME_DIRECT) break;
            case BRUME_CHANNEL_INDIRECT: PARTS(FILM_SURFACE_INDIRECT, FILM_VOLUME_INDIRECT) break;
            case BRUME_CHANNEL_SURFACE: PARTS(FILM_SURFACE_DIRECT, FILM_SURFACE_INDIRECT) break;
            case BRUME_CHANNEL_VOLUME: PARTS(FILM_VOLUME_DIRECT, FILM_VOLUME_INDIRECT) break;
            case BRUME_CHANNEL_SEGMENTS: *out++ = (float)(scale * PLANE(FILM_SEGMENTS)); break;
            case BRUME_CHANNEL_SAMPLE_COUNT: *out++ = (float)n; break;
            case BRUME_CHANNEL_ALPHA: *out++ = (float)(scale * PLANE(FILM_ALPHA)); break;
            }
#undef PARTS
#undef PLANE
        }
    }
}

/* Powers of the unit of light in a channel. */
static int light_power(brume_channel channel) {
    switch (channel) {
    case BRUME_CHANNEL_RADIANCE:
    case BRUME_CHANNEL_DIRECT:
    case BRUME_CHANNEL_INDIRECT:
    case BRUME_CHANNEL_SURFACE:
    case BRUME_CHANNEL_VOLUME: return 1;
    case BRUME_CHANNEL_VARIANCE:
    case BRUME_CHANNEL_ERROR: return 2;
    default: return 0;
    }
}

void brume_film_to_scene_light(double light_unit, brume_channel channel, float *values, size_t count) {
    double unit = pow(light_unit, light_power(channel));
    for (size_t i = 0; i < count && unit != 1; i++) {
        double value = unit * values[i];
        values[i] = value < FLT_MAX ? (float)value : FLT_MAX;
    }
}
