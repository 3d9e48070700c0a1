/* measure_light_tree.c -- prints how the variance and the time of a choice among lamps grow with their number: by the
 * tree, by a loop over all, by power, and evenly. Not a test.
 */
#include "light_queries.h"
#include "platform.h"

/* Relative variance of one sample of the sum, whose lamp is chosen with the probabilities `p`: over all queries, the
 * mean variance by the mean square. */
static double relative_variance(const double *p, double *out_wasted) {
    double variance = 0, squares = 0, wasted = 0;
    for (int q = 0; q < QUERIES; q++) {
        double sum = 0, second = 0, hit = 0;
        for (uint32_t k = 0; k < now.count; k++) {
            double f = now.contribution[(size_t)q * now.count + k], pk = p[(size_t)q * now.count + k];
            sum += f;
            hit += pk;
            if (f > 0 && pk > 0) second += f * f / pk;
        }
        variance += second - sum * sum;
        squares += sum * sum;
        wasted += (1 - hit) / QUERIES;
    }
    *out_wasted = wasted;
    return variance / squares;
}

static double seconds_per_choice(int tree) {
    double best = 1e30;
    int samples = tree || now.count <= 100 ? 1 << 12 : now.count <= 1000 ? 1 << 9 : 1 << 7;
    now.params.light_tree_blocks = tree ? (int)now.tree.block_count : 0;
    choose(16, samples);
    for (int i = 0; i < 3; i++) {
        double start = brume_seconds();
        choose(16, samples);
        best = fmin(best, brume_seconds() - start);
    }
    now.params.light_tree_blocks = (int)now.tree.block_count;
    return best / (QUERIES * samples);
}

/* Kinds of scenes as make_scene has them, for segments and for points. */
static void measure(void **state) {
    (void)state;
    static const uint32_t counts[] = {10, 20, 30, 60, 100, 300, 1000, 3000, 10000};
    static const char *kinds[] = {"odd", "stage", "", "points"};
    printf("%16s %6s %9s %9s %9s %9s %9s %9s %9s %9s\n", "", "lamps", "uniform", "power", "loop", "tree", "missed",
           "loop ns", "tree ns", "build ms");
    for (int i = 0; i < 6 * (int)(sizeof counts / sizeof *counts); i++) {
        int kind = i / (int)(sizeof counts / sizeof *counts), is_point = kind % 2;
        uint32_t count = counts[(size_t)i % (sizeof counts / sizeof *counts)];
        kind = kind / 2 == 0 ? 1 : kind / 2 == 1 ? 3 : 0;
        double missed, ignored, flux = 0, start = brume_seconds();
        make_scene(kind, count);
        double built = brume_seconds() - start;
        make_queries(kind, is_point);
        contribute();
        weigh(1);
        double tree = relative_variance(now.probability, &missed);
        weigh(0);
        double loop = relative_variance(now.probability, &ignored);
        size_t n = (size_t)QUERIES * now.count;
        for (size_t k = 0; k < n; k++) now.probability[k] = 1.0 / now.count;
        double uniform = relative_variance(now.probability, &ignored);
        for (size_t k = 0; k < now.count; k++) flux += luminance_of(&now.lights[k]) * now.lights[k].v_cutoff;
        for (size_t k = 0; k < n; k++)
            now.probability[k] = luminance_of(&now.lights[k % now.count]) * now.lights[k % now.count].v_cutoff / flux;
        double power = relative_variance(now.probability, &ignored);
        printf("%7s %8s %6u %9.3g %9.3g %9.3g %9.3g %9.3g %9.0f %9.0f %9.1f\n", kinds[kind],
               is_point ? "surface" : "segment", count, uniform, power, loop, tree, missed, 1e9 * seconds_per_choice(0),
               1e9 * seconds_per_choice(1), 1e3 * built);
        fflush(stdout);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(measure)};
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}
