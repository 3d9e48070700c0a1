/* checkpoint.c -- see checkpoint.h. */
#include "checkpoint.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "checkpoint_state.h"
#include "platform.h"

typedef struct prelude {
    char magic[8];
    uint32_t byte_order, version;
    uint64_t size; /* of what follows these 64 bytes */
    uint8_t sum[SHA256_SIZE];
    uint8_t pad[8];
} prelude;

typedef char prelude_is_64_bytes[sizeof(prelude) == 64 ? 1 : -1];
typedef char head_has_no_gaps[sizeof(brume_checkpoint_head) == 600 ? 1 : -1];

static const char magic[8] = {'b', 'r', 'u', 'm', 'e', 's', 'a', 'v'};
enum { BYTE_ORDER = 0x01020304, VERSION = 3 };

/* ---- reading ---- */

static brume_result wrong(brume_context *context, const char *path, const char *what) {
    return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: %s", path, what);
}

/* What merging writes is no checkpoint: samples are added up from all parts at once. */
static int is_picture(const prelude *first) {
    static const char exr[4] = {0x76, 0x2f, 0x31, 0x01}, png[4] = {(char)0x89, 'P', 'N', 'G'};
    return memcmp(first->magic, exr, sizeof exr) == 0 || memcmp(first->magic, png, sizeof png) == 0;
}

/* All of a file that is as long as its first bytes say, behind them. */
static brume_result read_bytes(brume_context *context, const char *path, FILE *file, prelude *first, uint8_t **out) {
    int is_long = fread(first, sizeof *first, 1, file) == 1;
    if (is_long && is_picture(first))
        return wrong(context, path, "is a picture, which lacks what going on or adding up takes; expected a checkpoint; "
                                    "what has been added up can't be added to: give all of its checkpoints at once");
    if (!is_long || memcmp(first->magic, magic, sizeof magic) != 0) return wrong(context, path, "is not a checkpoint");
    if (first->byte_order != BYTE_ORDER) return wrong(context, path, "is a checkpoint of another kind of machine");
    if (first->version != VERSION)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: is a checkpoint of version %u; expected version %u",
                          path, first->version, (unsigned)VERSION);
    /* The length is believed only once the file has it. */
    uint64_t length;
    if (brume_file_length(file, &length) != 0 || first->size < sizeof(brume_checkpoint_head) ||
        length < sizeof *first || length - sizeof *first != first->size || first->size > SIZE_MAX)
        return wrong(context, path, "is damaged: its length is not what it should be");
    uint8_t *bytes = malloc((size_t)first->size);
    if (!bytes) return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    if (fread(bytes, 1, (size_t)first->size, file) != first->size) {
        free(bytes);
        return wrong(context, path, "is damaged: it can't be read to its end");
    }
    *out = bytes;
    return BRUME_OK;
}

brume_result brume_checkpoint_read(brume_context *context, const char *path, brume_checkpoint *out) {
    prelude first;
    uint8_t sum[SHA256_SIZE], *bytes = NULL;
    FILE *file = fopen(path, "rb");
    if (!file)
        return brume_fail(context, errno == ENOMEM ? BRUME_ERROR_MEMORY : BRUME_ERROR_CHECKPOINT, "%s: %s", path,
                          strerror(errno));
    brume_result result = read_bytes(context, path, file, &first, &bytes);
    fclose(file);
    if (result != BRUME_OK) return result;
    brume_sha256(bytes, (size_t)first.size, sum);
    brume_checkpoint c = {.bytes = bytes};
    memcpy(&c.head, bytes, sizeof c.head);
    const brume_checkpoint_head *h = &c.head;
    uint64_t pixels = (uint64_t)h->width * h->height;
    uint64_t planes = pixels * brume_film_plane_count(h->recorded) * sizeof(float);
    if (memcmp(sum, first.sum, sizeof sum) != 0)
        result = wrong(context, path, "is damaged: its checksum is wrong");
    else if (!brume_checkpoint_head_is_valid(h) || first.size - sizeof *h < planes)
        result = wrong(context, path, "is damaged: its parts don't fit each other");
    if (result != BRUME_OK) {
        free(bytes);
        return result;
    }
    c.planes = (const float *)(const void *)(bytes + sizeof *h); /* 600 bytes behind what malloc gave */
    c.rest = bytes + sizeof *h + planes;
    c.rest_size = (size_t)(first.size - sizeof *h - planes);
    *out = c;
    return BRUME_OK;
}

void brume_checkpoint_free(brume_checkpoint *checkpoint) {
    free(checkpoint->bytes);
    memset(checkpoint, 0, sizeof *checkpoint);
}

/* ---- comparing ---- */

typedef struct setting {
    const char *name;
    size_t at;
    int is_number; /* and not a code, which tells nobody anything */
} setting;

#define SETTING(name, member, is_number) {name, offsetof(brume_checkpoint_head, member), is_number}

static brume_result compare(brume_context *context, const char *path, const brume_checkpoint_head *head,
                            const brume_checkpoint_head *wanted, const char *other, const setting *settings) {
    for (const setting *s = settings; s->name; s++) {
        uint32_t a, b;
        memcpy(&a, (const char *)head + s->at, sizeof a);
        memcpy(&b, (const char *)wanted + s->at, sizeof b);
        if (a != b && s->is_number)
            return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: doesn't fit %s: its %s is %u, and not %u", path,
                              other, s->name, a, b);
        if (a != b)
            return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: doesn't fit %s: its %s is another one", path, other,
                              s->name);
    }
    return BRUME_OK;
}

brume_result brume_checkpoint_same_picture(brume_context *context, const char *path, const brume_checkpoint_head *head,
                                           const brume_checkpoint_head *wanted, const char *other) {
    static const setting settings[] = {
        SETTING("width", full_width, 1),    SETTING("height", full_height, 1), SETTING("crop's left edge", crop_x, 1),
        SETTING("crop's top edge", crop_y, 1), SETTING("crop's width", width, 1), SETTING("crop's height", height, 1),
        SETTING("seed", seed, 1),           SETTING("precision", precision, 0),
        SETTING("choice of layers", recorded, 0),
        SETTING("sampler", sampler, 0),     SETTING("strategy", strategy, 0),  SETTING("strategy", positions, 0),
        SETTING("way of indirect light", indirect, 0), SETTING("choice of effects", without, 0),
        SETTING("clamp", clamp, 0),         {NULL, 0, 0}};
    BRUME_TRY(compare(context, path, head, wanted, other, settings));
    if (memcmp(head->scene, wanted->scene, sizeof head->scene) != 0)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: doesn't fit %s: its scene is another one", path, other);
    if (memcmp(head->kernels, wanted->kernels, sizeof head->kernels) != 0)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: doesn't fit %s: it is from another version of brume",
                          path, other);
    return BRUME_OK;
}

brume_result brume_checkpoint_same_render(brume_context *context, const char *path, const brume_checkpoint_head *head,
                                          const brume_checkpoint_head *wanted, const char *other) {
    static const setting settings[] = {
        SETTING("first sample", first_sample, 1), SETTING("adaptive sampling", adaptive, 0),
        SETTING("time limit", has_time_limit, 0), SETTING("error estimate", error_estimate, 0), {NULL, 0, 0}};
    BRUME_TRY(brume_checkpoint_same_picture(context, path, head, wanted, other));
    BRUME_TRY(compare(context, path, head, wanted, other, settings));
    if (head->noise_threshold != wanted->noise_threshold)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT,
                          "%s: doesn't fit %s: its noise threshold is %g, and not %g", path, other,
                          head->noise_threshold, wanted->noise_threshold);
    return BRUME_OK;
}

/* ---- writing ---- */

brume_result brume_checkpoint_begin(brume_context *context, const char *path, brume_checkpoint_writer *out) {
    brume_file_remove_stale(path);
    BRUME_TRY(brume_output_open(context, path, &out->output));
    out->output.durable = 1;
    out->output.end = sizeof(prelude);
    brume_sha256_start(&out->sum);
    return BRUME_OK;
}

int brume_checkpoint_append(brume_checkpoint_writer *writer, const void *bytes, size_t size) {
    brume_sha256_add(&writer->sum, bytes, size);
    return brume_output_append(&writer->output, bytes, size);
}

brume_result brume_checkpoint_end(brume_context *context, brume_checkpoint_writer *writer, int keep) {
    prelude first = {.byte_order = BYTE_ORDER, .version = VERSION, .size = writer->output.end - sizeof first};
    memcpy(first.magic, magic, sizeof magic);
    brume_sha256_end(&writer->sum, first.sum);
    brume_output_write(&writer->output, &first, sizeof first, 0);
    return brume_output_close(context, &writer->output, keep);
}
