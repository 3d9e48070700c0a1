/* image_jpeg.c -- JPEG (ITU-T T.81) by libjpeg, whichever of its kin the system has.
 *
 * What libjpeg calls an error must not return to it, and jumps back here; so does what it calls a warning, after which
 * it would go on with grey or rubbish.
 */
#include "image_jpeg.h"

#include <limits.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <jerror.h>

/* A scan of nothing but "all zeros from here" takes a few bytes and goes over the whole picture. What programs write
 * has some ten; libjpeg-turbo's own limit, where one is asked for, is this. */
enum { MOST_SCANS = 500 };

typedef struct reader {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    struct jpeg_progress_mgr progress;
    jmp_buf failed;
    const char *why; /* ours; NULL: libjpeg's */
    unsigned char *rgb;
} reader;

static void give_up(j_common_ptr jpeg) { longjmp(((reader *)jpeg->client_data)->failed, 1); }

static void refuse(reader *r, const char *why) {
    r->why = why;
    longjmp(r->failed, 1);
}

/* Below 0: a warning; from 0 on: a trace, which nobody wants. */
static void take_message(j_common_ptr jpeg, int level) {
    if (level < 0) give_up(jpeg);
}

static void print_nothing(j_common_ptr jpeg) { (void)jpeg; }

static void count_scans(j_common_ptr jpeg) {
    reader *r = jpeg->client_data;
    if (r->jpeg.input_scan_number > MOST_SCANS) refuse(r, "it has more than 500 scans");
}

/* Every 8x8 block of every component takes a Huffman code at least, which is one bit or more. */
static int holds_less_than_it_says(const reader *r, size_t size) {
    uint64_t blocks = 0;
    for (int i = 0; i < r->jpeg.num_components; i++)
        blocks += (uint64_t)r->jpeg.comp_info[i].width_in_blocks * r->jpeg.comp_info[i].height_in_blocks;
    return blocks > 8 * (uint64_t)size;
}

/* What the header says, before there is memory for it. */
static void check_header(reader *r, size_t size) {
    J_COLOR_SPACE colours = r->jpeg.jpeg_color_space;
    if (colours != JCS_GRAYSCALE && colours != JCS_RGB && colours != JCS_YCbCr)
        refuse(r, colours == JCS_CMYK || colours == JCS_YCCK
                      ? "its colours are CMYK: expected grey, RGB or YCbCr"
                      : "its colours are not known: expected grey, RGB or YCbCr");
    /* Nobody takes it for textures, and a block may take as good as no bits. */
    if (r->jpeg.arith_code) refuse(r, "arithmetic coding is not supported");
    if ((uint64_t)r->jpeg.image_width * r->jpeg.image_height > INT_MAX / 3) refuse(r, "the picture is too large");
    if (holds_less_than_it_says(r, size)) refuse(r, "the file is too short for as many pixels as it says");
}

/* Comes back only if all went well. */
static void decode(reader *r, const void *bytes, size_t size) {
    jpeg_create_decompress(&r->jpeg);
    r->jpeg.progress = &r->progress;
    jpeg_mem_src(&r->jpeg, bytes, (unsigned long)size);
    jpeg_read_header(&r->jpeg, TRUE);
    check_header(r, size);
    r->jpeg.out_color_space = JCS_RGB;
    r->jpeg.dct_method = JDCT_ISLOW;
    size_t line = 3 * (size_t)r->jpeg.image_width;
    r->rgb = malloc(line * r->jpeg.image_height);
    if (!r->rgb) ERREXIT1(&r->jpeg, JERR_OUT_OF_MEMORY, 0);
    jpeg_start_decompress(&r->jpeg);
    while (r->jpeg.output_scanline < r->jpeg.output_height) {
        JSAMPROW row = r->rgb + line * r->jpeg.output_scanline;
        jpeg_read_scanlines(&r->jpeg, &row, 1);
    }
    jpeg_finish_decompress(&r->jpeg); /* to the file's end, which may be missing */
}

static int try_to_decode(reader *r, const void *bytes, size_t size) {
    if (setjmp(r->failed) != 0) return 0;
    decode(r, bytes, size);
    return 1;
}

int brume_jpeg_is(const void *bytes, size_t size) {
    return size >= 2 && memcmp(bytes, "\xff\xd8", 2) == 0;
}

brume_result brume_jpeg_decode(const void *bytes, size_t size, int *out_width, int *out_height,
                               unsigned char **out_rgb, char why[BRUME_JPEG_WHY]) {
    reader r;
    brume_result result = BRUME_OK;
    memset(&r, 0, sizeof r);
    r.jpeg.client_data = &r;
    r.jpeg.err = jpeg_std_error(&r.errors);
    r.errors.error_exit = give_up;
    r.errors.emit_message = take_message;
    r.errors.output_message = print_nothing;
    r.progress.progress_monitor = count_scans;
    if (size > INT_MAX) {
        snprintf(why, BRUME_JPEG_WHY, "the file is too large");
        return BRUME_ERROR_SCENE;
    }
    if (try_to_decode(&r, bytes, size)) {
        *out_width = (int)r.jpeg.output_width;
        *out_height = (int)r.jpeg.output_height;
        *out_rgb = r.rgb;
    } else {
        char words[JMSG_LENGTH_MAX] = "";
        if (!r.why) r.errors.format_message((j_common_ptr)&r.jpeg, words);
        snprintf(why, BRUME_JPEG_WHY, "%s", r.why ? r.why : words);
        result = !r.why && r.errors.msg_code == JERR_OUT_OF_MEMORY ? BRUME_ERROR_MEMORY : BRUME_ERROR_SCENE;
        free(r.rgb);
    }
    jpeg_destroy_decompress(&r.jpeg);
    return result;
}
