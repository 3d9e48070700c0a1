/* test_sample_allocation.c -- who gets how many samples: the budget is kept, the error is put where it helps, and no
 * pixel decides on itself. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "open_device.h"
#include "sample_allocation.h"
#include "stats.h"

enum { WIDTH = 45, HEIGHT = 38, PIXELS = WIDTH * HEIGHT, FIRST = 16 };

/* A grey picture whose errors lie along a slanting line. */
static void make_estimate(brume_error_estimate *e) {
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, e), BRUME_OK);
    uint64_t random = 5;
    for (int i = 0; i < PIXELS; i++) {
        int from_line = abs(i % WIDTH - i / WIDTH);
        for (int c = 0; c < 3; c++) {
            e->mean[3 * i + c] = 1;
            e->last[3 * i + c] = (float)((from_line < 3 ? 1e-2 : 1e-6) * (0.5 + test_random_unit(&random)));
            e->before[3 * i + c] = 2 * e->last[3 * i + c];
        }
        e->level[i] = 4;
    }
}

static void budget_is_kept(void **state) {
    (void)state;
    static uint32_t counts[PIXELS];
    brume_error_estimate e;
    brume_allocation *a;
    make_estimate(&e);
    assert_non_null(a = brume_allocation_create(&e, 1.5, 1 << 14));
    for (double budget = 20; budget < 20000; budget *= 1.7) {
        int detail = brume_allocation_for_samples(a, budget);
        double samples, relmse, cost = 0;
        brume_allocation_predict(a, detail, &samples, &relmse);
        brume_allocation_counts(a, detail, counts);
        for (int i = 0; i < PIXELS; i++) cost += (double)counts[i] / PIXELS;
        assert_true(fabs(cost - samples) < 1e-9 * cost);
        assert_true(samples <= budget);
        /* Finely graded: little of the budget is left over, unless all have as many as they may. */
        assert_true(samples > 0.85 * budget || samples > 0.999 * (1 << 14));
    }
    brume_allocation_free(a);
    brume_error_estimate_free(&e);
}

static void counts_are_powers_of_two_and_only_grow(void **state) {
    (void)state;
    static uint32_t counts[PIXELS], before[PIXELS];
    brume_error_estimate e;
    brume_allocation *a;
    make_estimate(&e);
    assert_non_null(a = brume_allocation_create(&e, 1.5, 1 << 12));
    brume_allocation_counts(a, 0, before);
    for (int i = 0; i < PIXELS; i++) assert_int_equal(before[i], FIRST);
    double error_before = INFINITY;
    for (int detail = 1; detail < brume_allocation_most_detail(a); detail += 3) {
        double samples, error;
        brume_allocation_counts(a, detail, counts);
        brume_allocation_predict(a, detail, &samples, &error);
        for (int i = 0; i < PIXELS; i++) {
            assert_true((counts[i] & (counts[i] - 1)) == 0 && counts[i] >= before[i] && counts[i] <= 1 << 12);
            before[i] = counts[i];
        }
        assert_true(error <= error_before);
        error_before = error;
    }
    brume_allocation_counts(a, brume_allocation_most_detail(a), counts);
    for (int i = 0; i < PIXELS; i++) assert_int_equal(counts[i], 1 << 12);
    brume_allocation_free(a);
    brume_error_estimate_free(&e);
}

/* With all errors on a line, it gets most of the samples; and the error that was asked for is what is predicted. */
static void samples_go_where_the_error_is(void **state) {
    (void)state;
    static uint32_t counts[PIXELS];
    brume_error_estimate e;
    brume_allocation *a;
    make_estimate(&e);
    assert_non_null(a = brume_allocation_create(&e, 1.5, 1 << 16));
    double samples, relmse, all, start;
    brume_allocation_predict(a, 0, &all, &start);
    assert_true(fabs(all - FIRST) < 1e-9);
    int detail = brume_allocation_for_error(a, start / 50);
    brume_allocation_predict(a, detail, &samples, &relmse);
    assert_true(relmse <= start / 50 && relmse > start / 70);
    brume_allocation_counts(a, detail, counts);
    double on = 0, off = 0, n_on = 0, n_off = 0;
    for (int i = 0; i < PIXELS; i++) {
        int from_line = abs(i % WIDTH - i / WIDTH);
        if (from_line < 3) on += counts[i], n_on++;
        if (from_line > 9) off += counts[i], n_off++;
    }
    assert_true(on / n_on > 8 * (off / n_off));
    /* All alike would have taken 50^(1 / 1.5) as many for that. */
    assert_true(samples < 0.6 * FIRST * pow(50, 1 / 1.5));
    brume_allocation_free(a);
    brume_error_estimate_free(&e);
}

/* Errors on a line of single pixels, steep or flat: those beside it get much fewer samples than those on it. */
static void a_line_is_a_pixel_wide(void **state) {
    (void)state;
    static uint32_t counts[PIXELS];
    for (int slope = 0; slope < 3; slope++) {
        brume_error_estimate e;
        brume_allocation *a;
        double on = 0, beside = 0, n_on = 0, n_beside = 0;
        make_estimate(&e);
        for (int i = 0; i < PIXELS; i++) {
            int off = abs(i % WIDTH - 8 - i / WIDTH * slope / 2);
            for (int c = 0; c < 3; c++) e.last[3 * i + c] *= off == 0 ? 1e4f : 1;
            for (int c = 0; c < 3; c++) e.last[3 * i + c] = fminf(e.last[3 * i + c], off == 0 ? 1 : 1e-6f);
            for (int c = 0; c < 3; c++) e.before[3 * i + c] = 2 * e.last[3 * i + c];
        }
        assert_non_null(a = brume_allocation_create(&e, 1.5, 1 << 16));
        brume_allocation_counts(a, brume_allocation_for_samples(a, 200), counts);
        for (int i = 0; i < PIXELS; i++) {
            int x = i % WIDTH, y = i / WIDTH, off = abs(x - 8 - y * slope / 2);
            if (x < 3 || y < 3 || x > WIDTH - 4 || y > HEIGHT - 4) continue;
            if (off == 0) on += counts[i], n_on++;
            if (off == 1) beside += counts[i], n_beside++;
        }
        print_message("slope %d: %.0f samples on the line, %.0f beside it\n", slope, on / n_on, beside / n_beside);
        assert_true(on / n_on > 1.4 * (beside / n_beside));
        brume_allocation_free(a);
        brume_error_estimate_free(&e);
    }
}

/* However a pixel's own error changes, the total being the same, its count does not. */
static void a_pixel_has_no_say_in_its_count(void **state) {
    (void)state;
    brume_error_estimate e;
    brume_allocation *a, *b;
    make_estimate(&e);
    const int here = 20 * WIDTH + 12, there = 2 * WIDTH + 40;
    for (int c = 0; c < 3; c++) e.last[3 * here + c] = 0, e.last[3 * there + c] = 1;
    assert_non_null(a = brume_allocation_create(&e, 1.5, 1 << 12));
    for (int c = 0; c < 3; c++) e.last[3 * here + c] = 1, e.last[3 * there + c] = 0;
    assert_non_null(b = brume_allocation_create(&e, 1.5, 1 << 12));
    assert_int_equal(a->bin[here], b->bin[here]);
    assert_int_equal(a->bin[there], b->bin[there]);
    assert_true(b->bin[here + 1] > a->bin[here + 1] + 8); /* while its neighbours get more */
    brume_allocation_free(a);
    brume_allocation_free(b);
    brume_error_estimate_free(&e);
}

/* In as many threads as there are pieces or more, or some that share them: the same bits. */
static void threads_change_nothing(void **state) {
    (void)state;
    brume_error_estimate e;
    brume_allocation *alone, *a;
    make_estimate(&e);
    e.threads = 1;
    assert_non_null(alone = brume_allocation_create(&e, 1.5, 1 << 14));
    for (uint32_t times = 0; times < 90; times++) { /* two threads that disturb each other must meet */
        e.threads = 2 + times % 7;
        assert_non_null(a = brume_allocation_create(&e, 1.5, 1 << 14));
        assert_memory_equal(a->bin, alone->bin, PIXELS * sizeof *a->bin);
        assert_memory_equal(a->error, alone->error, sizeof a->error);
        assert_memory_equal(a->cost, alone->cost, sizeof a->cost);
        brume_allocation_free(a);
    }
    brume_allocation_free(alone);
    brume_error_estimate_free(&e);
}

/* ---- what it is for: pixels that see light once in 20 samples, unbiased ---- */

/* The mean over a picture of the pixels' means, when each gets its count from `own` differences or its neighbours'. */
static double picture_mean(uint64_t *random, int own) {
    static float mean[3 * PIXELS], count[PIXELS];
    static double sums[PIXELS];
    static uint32_t counts[PIXELS];
    brume_error_estimate e;
    brume_allocation *a;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 1, &e), BRUME_OK);
    memset(sums, 0, sizeof sums);
    for (int n = 1, level = 0; n <= FIRST; n *= 2, level++) {
        for (int i = 0; i < PIXELS; i++) {
            for (int k = n == 1 ? 0 : n / 2; k < n; k++) sums[i] += test_random_unit(random) < 0.05 ? 20 : 0;
            for (int c = 0; c < 3; c++) mean[3 * i + c] = (float)(sums[i] / n);
            count[i] = (float)n;
        }
        brume_error_estimate_update(&e, mean, count, level);
    }
    if (own) {
        for (int i = 0; i < PIXELS; i++) counts[i] = e.last[3 * i] > 0 ? 16 * FIRST : FIRST;
    } else {
        assert_non_null(a = brume_allocation_create(&e, 1, 1 << 12));
        brume_allocation_counts(a, brume_allocation_for_samples(a, 5 * FIRST), counts);
        brume_allocation_free(a);
    }
    double total = 0;
    for (int i = 0; i < PIXELS; i++) {
        for (uint32_t k = FIRST; k < counts[i]; k++) sums[i] += test_random_unit(random) < 0.05 ? 20 : 0;
        total += sums[i] / counts[i];
    }
    brume_error_estimate_free(&e);
    return total / PIXELS;
}

static void means_are_unbiased(void **state) {
    (void)state;
    enum { PICTURES = 40 };
    double ours[PICTURES], planted[PICTURES];
    uint64_t random = 77;
    for (int i = 0; i < PICTURES; i++) {
        ours[i] = picture_mean(&random, 0);
        planted[i] = picture_mean(&random, 1);
    }
    assert_true(stats_mean(ours, PICTURES, 1) > CONFIDENCE);
    assert_true(stats_mean(planted, PICTURES, 1) < CONFIDENCE); /* stopping where nothing was seen loses light */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(budget_is_kept),
        cmocka_unit_test(counts_are_powers_of_two_and_only_grow),
        cmocka_unit_test(samples_go_where_the_error_is),
        cmocka_unit_test(a_line_is_a_pixel_wide),
        cmocka_unit_test(a_pixel_has_no_say_in_its_count),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(means_are_unbiased),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}
