/* same_picture.c -- see same_picture.h. */
#include "same_picture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { BLOCK = 8 };

void picture_render(brume_scene *scene, picture *out) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render = NULL;
    brume_render_stats stats;
    desc.guides = 0;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, out->mean, PICTURE_VALUES));
    must(brume_render_read(render, BRUME_CHANNEL_VARIANCE, out->variance, PICTURE_VALUES));
    must(brume_render_get_stats(render, &stats));
    assert_int_equal(stats.bad_samples, 0);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

int picture_differing(const picture *a, const picture *b, double factor) {
    int count = 0;
    for (int i = 0; i < PICTURE_VALUES; i++)
        count += !((double)b->mean[i] == factor * (double)a->mean[i]);
    return count;
}

/* The mean difference of a square of pixels in one channel, beyond the drift, in its standard errors: by the spread of
 * the differences, which is small where both pictures have the same noise, or by that of the samples, which no error of
 * the picture enlarges. */
static double square_apart(const picture *a, const picture *b, int left, int top, int size, int channel) {
    const int n = size * size;
    double sum = 0, squares = 0, level = 0, variance = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < n; i++) {
            int at = 3 * ((top + i / size) * PIXELS + left + i % size) + channel;
            double d = (double)b->mean[at] - a->mean[at];
            if (pass == 0) {
                sum += d;
                level += a->mean[at];
                variance += (double)a->variance[at] + b->variance[at];
            } else {
                squares += (d - sum / n) * (d - sum / n);
            }
        }
    double beyond = fabs(sum) - PICTURE_DRIFT * fabs(level);
    return beyond <= 0 ? 0 : beyond / sqrt(fmin(variance, squares * n / (n - 1.0)));
}

double picture_errors_apart(const picture *a, const picture *b) {
    double most = 0;
    for (int c = 0; c < 3; c++) {
        most = fmax(most, square_apart(a, b, 0, 0, PIXELS, c));
        for (int y = 0; y < PIXELS; y += BLOCK)
            for (int x = 0; x < PIXELS; x += BLOCK)
                most = fmax(most, square_apart(a, b, x, y, BLOCK, c));
    }
    return most;
}
