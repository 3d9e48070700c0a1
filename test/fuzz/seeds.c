/* seeds.c -- what fuzzing starts from: for each target a few small files that are right, or nearly. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "../jpeg_file.h"
#include "checkpoint_state.h"
#include "image.h"
#include "targets.h"

typedef struct seed {
    const char *target, *name, *text;
} seed;

static const seed texts[] = {
    {"scene", "small",
     "<scene version='3.0.0'><default name='size' value='12'/><default name='half' value='$size'/>"
     "<integrator type='volpath'><integer name='max_depth' value='4'/></integrator>"
     "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.1'/>"
     "<rgb name='albedo' value='0.9, 0.8, 0.7'/><phase type='hg'><float name='g' value='0.3'/></phase></medium>"
     "<sensor type='perspective'><ref id='fog'/><film type='hdrfilm'><integer name='width' value='$half'/>"
     "<rfilter type='gaussian'/></film><sampler type='independent'/><transform name='to_world'>"
     "<lookat origin='0, 1, 2' target='0, 0, 0' up='0, 1, 0'/></transform></sensor>"
     "<shape type='sphere'><point name='center' x='1' y='2' z='3'/><bsdf type='dielectric'/></shape>"
     "<emitter type='spot'><transform name='to_world'><rotate y='1' angle='$given'/></transform></emitter></scene>"},
    {"scene", "files",
     "<scene version='3.0.0'><path value='.'/><include filename='part.xml'/><shape type='obj'>"
     "<string name='filename' value='m.obj'/><ref id='paint'/></shape><shape type='ply'>"
     "<string name='filename' value='m.ply'/></shape></scene>"
     "\n%% part.xml\n<scene version='3.0.0'><bsdf type='twosided' id='paint'><bsdf type='diffuse'>"
     "<rgb name='reflectance' value='0.5'/></bsdf></bsdf><alias id='paint' as='other'/></scene>"
     "\n%% m.obj\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
     "\n%% m.ply\nply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
     "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
    {"scene", "colours",
     "<scene version='3.0.0'><bsdf type='roughconductor' id='m'><string name='material' value='Cu'/>"
     "<float name='alpha' value='0.2'/></bsdf><bsdf type='diffuse' id='c'><texture type='checkerboard' "
     "name='reflectance'><transform name='to_uv'><scale value='4'/></transform></texture></bsdf>"
     "<emitter type='constant'><spectrum name='radiance' value='400:0.1, 500:0.5, 700:0.2'/></emitter>"
     "<shape type='rectangle'><transform name='to_world'><matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1'/>"
     "</transform><emitter type='area'><rgb name='radiance' value='#ff8800'/></emitter><ref id='m'/></shape></scene>"},
    {"scene", "includes itself", "<scene version='3.0.0'><include filename='scene.xml'/></scene>"},
    {"scene", "entities", "<!DOCTYPE x [<!ENTITY a 'b'><!ENTITY c '&a;&a;'>]><scene version='3.0.0'>&c;</scene>"},
    {"scene", "outward",
     "<scene version='3.0.0'><path value='/'/><include filename='/etc/passwd'/><shape type='obj'>"
     "<string name='filename' value='../../../../dev/stdin'/></shape></scene>"},
    {"obj", "quad", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1 4/2/1\n"},
    {"obj", "negative", "o a\ng b\nusemtl c\nmtllib d.mtl\ns 1\nv 0 0 0\nv 1 0 0\nv 0 1 0 1\nf -3//-1 -2 -1\n"},
    {"obj", "concave", "v 0 0 0\nv 2 0 0\nv .5 .5 0\nv 0 2e0 0\nf 1 2 3 4\nl 1 2\np 1\n"},
    {"ply", "triangle",
     "ply\nformat ascii 1.0\ncomment x\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
     "property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\nelement face 1\n"
     "property list uchar int vertex_indices\nend_header\n0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n0 1 0 0 0 1 0 1\n"
     "3 0 1 2\n"},
};

static const unsigned char binary_ply[] =
    "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_index\nend_header\n"
    "\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200\77\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200\77\0\0\0\0\3\0\0\0\0\1\0\0\0\2\0\0\0";

/* 3 x 2 pixels, run-length encoding not used. */
static const unsigned char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n"
                                   "abcdefghijklmnopqrstuvwx";

static int write_seed(const char *folder, const char *target, const char *name, const void *bytes, size_t size) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, target);
    if (mkdir(path, 0777) != 0 && errno != EEXIST) return 0;
    snprintf(path, sizeof path, "%s/%s/%s", folder, target, name);
    FILE *file = fopen(path, "wb");
    int done = file && fwrite(bytes, 1, size, file) == size;
    return file && fclose(file) == 0 && done;
}

static int write_pictures(const char *folder) {
    enum { WIDTH = 9, HEIGHT = 18 };
    static float rgb[3 * WIDTH * HEIGHT];
    char path[512];
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) rgb[i] = (float)(i * 7 % 11) * 0.09f;
    const brume_exr_channel channels[4] = {
        {"R", rgb, 3, 1}, {"G", rgb + 1, 3, 1}, {"B", rgb + 2, 3, 1}, {"Z", rgb, 3, 0}};
    const brume_exr_channel grey = {"Y", rgb, 1, 0};
    snprintf(path, sizeof path, "%s/picture/rgb.exr", folder);
    int done = brume_exr_write(NULL, path, 2, 3, WIDTH, HEIGHT, 20, 30, channels, 4, NULL, 0) == BRUME_OK;
    snprintf(path, sizeof path, "%s/picture/grey.exr", folder);
    done = done && brume_exr_write(NULL, path, 0, 0, WIDTH, HEIGHT, WIDTH, HEIGHT, &grey, 1, NULL, 0) == BRUME_OK;
    snprintf(path, sizeof path, "%s/picture/rgb.png", folder);
    return done && brume_png_write(NULL, path, WIDTH, HEIGHT, rgb, 0, BRUME_TONEMAP_NONE, "a comment") == BRUME_OK;
}

static int write_jpegs(const char *folder) {
    enum { WIDTH = 9, HEIGHT = 18 };
    static const struct { const char *name; jpeg_kind kind; } kinds[] = {
        {"rgb.jpg", {3, 80, 0, 1, 0}}, {"progressive.jpg", {3, 80, 1, 0, 0}}, {"grey.jpg", {1, 80, 2, 0, 0}}};
    unsigned char pixels[3 * WIDTH * HEIGHT];
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) pixels[i] = (unsigned char)(i * 7 % 11 * 22);
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        size_t size;
        unsigned char *bytes = jpeg_write(&kinds[i].kind, WIDTH, HEIGHT, pixels, &size);
        int done = bytes && write_seed(folder, "picture", kinds[i].name, bytes, size);
        free(bytes);
        if (!done) return 0;
    }
    return 1;
}

enum { SAVED_WIDTH = 3, SAVED_HEIGHT = 2, SAVED = SAVED_WIDTH * SAVED_HEIGHT };

static int append_state(brume_checkpoint_writer *writer, brume_error_estimate *e) {
    uint32_t done[SAVED], ends[SAVED];
    for (int i = 0; i < SAVED; i++) {
        e->level[i] = 3;
        done[i] = 8;
        ends[i] = i % 2 ? 32 : 8;
    }
    for (int i = 0; i < 3 * SAVED; i++) {
        e->mean[i] = 1;
        e->last[i] = e->before[i] = 0.01f * (float)(1 + i % 5);
    }
    brume_allocation *a = brume_allocation_create(e, 1.5, 1 << 20);
    uint8_t *bytes = a ? malloc(brume_allocation_bytes(a)) : NULL;
    if (bytes) {
        brume_allocation_pack(a, bytes);
        brume_checkpoint_append(writer, e->mean, 3 * SAVED * sizeof *e->mean);
        brume_checkpoint_append(writer, e->last, 3 * SAVED * sizeof *e->last);
        brume_checkpoint_append(writer, e->before, 3 * SAVED * sizeof *e->before);
        brume_checkpoint_append(writer, e->level, SAVED);
        brume_checkpoint_append(writer, done, sizeof done);
        brume_checkpoint_append(writer, ends, sizeof ends);
        brume_checkpoint_append(writer, bytes, brume_allocation_bytes(a));
    }
    int written = bytes != NULL;
    free(bytes);
    brume_allocation_free(a);
    return written;
}

/* The film alone; or all there is, in the middle of a pass of some pixels, three groups of them. `doubtful`: groups. */
static int write_checkpoint(const char *folder, const char *name, int adaptive, uint32_t doubtful) {
    static const float planes[10 * SAVED];
    char path[512];
    brume_checkpoint_writer writer;
    brume_error_estimate e;
    brume_checkpoint_head head;
    memset(&head, 0, sizeof head);
    head.width = head.full_width = SAVED_WIDTH;
    head.height = head.full_height = SAVED_HEIGHT;
    head.group_count = SAVED;
    head.lanes = 1;
    head.light_unit = 1;
    head.sample_count = 64;
    if (adaptive) {
        head.adaptive = BRUME_ADAPTIVE_ON;
        head.error_estimate = head.has_counts = head.has_allocation = 1;
        head.stage_end = 32;
        head.samples_done = 8;
        head.pass_samples = 8;
        head.groups_done = 1;
        head.doubtful = doubtful;
        head.doubtful_lanes = 1;
    }
    snprintf(path, sizeof path, "%s/checkpoint", folder);
    if (mkdir(path, 0777) != 0 && errno != EEXIST) return 0;
    snprintf(path, sizeof path, "%s/checkpoint/%s", folder, name);
    if (brume_checkpoint_begin(NULL, path, &writer) != BRUME_OK) return 0;
    brume_checkpoint_append(&writer, &head, sizeof head);
    brume_checkpoint_append(&writer, planes, sizeof planes);
    int written = !adaptive;
    if (adaptive && brume_error_estimate_create(NULL, SAVED_WIDTH, SAVED_HEIGHT, 0, &e) == BRUME_OK) {
        written = append_state(&writer, &e);
        brume_error_estimate_free(&e);
    }
    return brume_checkpoint_end(NULL, &writer, written) == BRUME_OK && written;
}

int fuzz_write_seeds(const char *folder) {
    if (mkdir(folder, 0777) != 0 && errno != EEXIST) return 0;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        if (!write_seed(folder, texts[i].target, texts[i].name, texts[i].text, strlen(texts[i].text))) return 0;
    return write_seed(folder, "ply", "binary", binary_ply, sizeof binary_ply - 1) &&
           write_seed(folder, "picture", "plain.hdr", hdr, sizeof hdr - 1) && write_pictures(folder) &&
           write_jpegs(folder) && write_checkpoint(folder, "small", 0, 0) &&
           write_checkpoint(folder, "adaptive", 1, 1) && write_checkpoint(folder, "too many groups", 1, 3);
}
