/* measure_agreement.c -- [--device NAME] SCENE.xml...: how many samples differ, by how much, and which differs most.
 *
 * Between float and double, as test_precision does for some scenes; or in float between the default device and the one
 * whose platform contains NAME, each at every width. Fails if any sample is NaN, or more than one in fifty is off
 * by 1e-4, which double and float are in the wood, where each ray asks for visibility at many points, once in 75; or,
 * between devices, if any bit is another.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sample_pairs.h"

static brume_context *context;

static void must(brume_result r) {
    if (r == BRUME_OK) return;
    fprintf(stderr, "%s\n", brume_context_message(context));
    exit(1);
}

/* Whose platform contains `name`, or doesn't; exits where there is none. */
static brume_device *open_named(const char *name, int contains) {
    uint32_t count;
    brume_device_info info;
    brume_device *device;
    must(brume_device_count(context, &count));
    for (uint32_t i = 0; i < count; i++) {
        must(brume_device_describe(context, i, &info));
        if ((strstr(info.platform, name) != NULL) != contains) continue;
        printf("%s, %s, driver %s\n", info.platform, info.name, info.driver);
        must(brume_device_open(context, i, &device));
        return device;
    }
    fprintf(stderr, "no device that is %s%s\n", contains ? "" : "not ", name);
    exit(1);
}

/* Whether they agree. */
static int compare(const char *path, const sample_maker makers[2]) {
    brume_scene *scene;
    must(brume_scene_load(context, path, NULL, 0, &scene));
    sample_pairs p = sample_pairs_compare(context, scene, makers, 4);
    brume_scene_destroy(scene);
    if (p.message) {
        printf("%s: %s\n", path, p.message);
        return 0;
    }
    double n = p.count;
    printf("%-34s %2u %7.3f%% %8.3f%% %8.3f%% %8.3f%%  %9.2g  %u,%u,%u%s\n", path, makers[1].lanes,
           100 * p.different / n, 100 * p.above[1] / n, 100 * p.above[2] / n, 100 * p.above[3] / n,
           p.mean > 0 ? p.worst / p.mean : 0, p.worst_x, p.worst_y, p.worst_sample, p.bad ? "  NaN" : "");
    fflush(stdout);
    int same = makers[0].precision == makers[1].precision ? p.different == 0 : p.above[1] <= 0.02 * n;
    return same && p.bad == 0;
}

int main(int count, char **arguments) {
    int first = 1, failed = 0;
    must(brume_context_create(&context));
    const char *name = count > 2 && strcmp(arguments[1], "--device") == 0 ? arguments[2] : NULL;
    sample_maker makers[2] = {{NULL, BRUME_PRECISION_FLOAT, 1}, {NULL, BRUME_PRECISION_DOUBLE, 1}};
    if (name) {
        makers[0].device = open_named(name, 0);
        makers[1].device = open_named(name, 1);
        makers[1].precision = BRUME_PRECISION_FLOAT;
        first = 3;
    } else {
        must(brume_device_open(context, BRUME_DEVICE_ANY, &makers[0].device));
        makers[1].device = makers[0].device;
    }
    printf("%-34s %2s %8s %9s %9s %9s  %9s  %s\n", "scene", "w", "differ", ">1e-4", ">1e-3", ">1e-2", "most/mean",
           "pixel and sample");
    for (int i = first; i < count; i++)
        for (uint32_t lanes = name ? 8 : 1; lanes >= 1; lanes /= 8) {
            makers[1].lanes = lanes;
            failed |= !compare(arguments[i], makers);
        }
    if (makers[1].device != makers[0].device) brume_device_destroy(makers[1].device);
    brume_device_destroy(makers[0].device);
    brume_context_destroy(context);
    return failed;
}
