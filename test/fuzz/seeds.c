/* seeds.c -- what fuzzing starts from: for each target a few small files that are right, or nearly. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "checkpoint.h"
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

static int write_checkpoint(const char *folder) {
    enum { PIXELS = 6 };
    static const float planes[10 * PIXELS];
    char path[512];
    brume_checkpoint_head head;
    brume_checkpoint_writer writer;
    memset(&head, 0, sizeof head);
    head.width = head.full_width = 3;
    head.height = head.full_height = 2;
    head.group_count = 6;
    head.lanes = 1;
    snprintf(path, sizeof path, "%s/checkpoint", folder);
    if (mkdir(path, 0777) != 0 && errno != EEXIST) return 0;
    snprintf(path, sizeof path, "%s/checkpoint/small", folder);
    if (brume_checkpoint_begin(NULL, path, &writer) != BRUME_OK) return 0;
    brume_checkpoint_append(&writer, &head, sizeof head);
    brume_checkpoint_append(&writer, planes, sizeof planes);
    return brume_checkpoint_end(NULL, &writer, 1) == BRUME_OK;
}

int fuzz_write_seeds(const char *folder) {
    if (mkdir(folder, 0777) != 0 && errno != EEXIST) return 0;
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        if (!write_seed(folder, texts[i].target, texts[i].name, texts[i].text, strlen(texts[i].text))) return 0;
    return write_seed(folder, "ply", "binary", binary_ply, sizeof binary_ply - 1) &&
           write_seed(folder, "picture", "plain.hdr", hdr, sizeof hdr - 1) && write_pictures(folder) &&
           write_checkpoint(folder);
}
