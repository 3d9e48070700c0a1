/* measure_difference.c -- how far two pictures of one scene are apart, as from two machines:
 *     measure_difference A.exr B.exr BOUND
 * Differences are relative to the larger of a value and the mean of A. Fails beyond the bound; 0 asks for the same
 * bits. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "brume.h"

static int load(brume_context *context, const char *path, uint32_t size[2], float **rgb) {
    if (!brume_picture_read(context, path, &size[0], &size[1], rgb)) return 1;
    fprintf(stderr, "measure_difference: %s\n", brume_context_message(context));
    return 0;
}

int main(int argc, char **argv) {
    brume_context *context = NULL;
    uint32_t a_size[2], b_size[2];
    float *a = NULL, *b = NULL;
    double mean = 0, largest = 0;
    size_t different = 0;
    if (argc != 4 || brume_context_create(&context)) return 2;
    if (!load(context, argv[1], a_size, &a) || !load(context, argv[2], b_size, &b)) return 2;
    if (memcmp(a_size, b_size, sizeof a_size) != 0) {
        fprintf(stderr, "measure_difference: the pictures are not of one size\n");
        return 2;
    }
    size_t count = 3 * (size_t)a_size[0] * a_size[1];
    for (size_t i = 0; i < count; i++) mean += fabs(a[i]) / (double)count;
    for (size_t i = 0; i < count; i++) {
        double apart = fabs((double)a[i] - b[i]) / fmax(fmax(fabs(a[i]), mean), 1e-30);
        different += memcmp(&a[i], &b[i], sizeof a[i]) != 0;
        largest = apart > largest || isnan(apart) ? apart : largest;
    }
    printf("%zu of %zu values differ, by %.2g at most; mean %.4g\n", different, count, largest, mean);
    int within = atof(argv[3]) > 0 ? largest <= atof(argv[3]) : different == 0;
    brume_picture_free(a);
    brume_picture_free(b);
    brume_context_destroy(context);
    return !within;
}
