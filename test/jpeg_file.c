/* jpeg_file.c -- see jpeg_file.h. */
#include "jpeg_file.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>

#include <jpeglib.h>

static void give_up(j_common_ptr jpeg) { longjmp(*(jmp_buf *)jpeg->client_data, 1); }

unsigned char *jpeg_write(const jpeg_kind *kind, unsigned width, unsigned height, const unsigned char *pixels,
                          size_t *out_size) {
    static const J_COLOR_SPACE colours[] = {JCS_UNKNOWN, JCS_GRAYSCALE, JCS_UNKNOWN, JCS_RGB, JCS_CMYK};
    static const jpeg_scan_info two[] = {{1, {0}, 0, 0, 0, 0}, {1, {0}, 1, 63, 0, 0}};
    static unsigned char *bytes; /* static: kept where the jump does not reach it */
    static unsigned long size;
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf failed;
    bytes = NULL;
    size = 0;
    jpeg.err = jpeg_std_error(&errors);
    errors.error_exit = give_up;
    jpeg.client_data = &failed;
    jpeg_create_compress(&jpeg);
    if (setjmp(failed) == 0) {
        jpeg_mem_dest(&jpeg, &bytes, &size);
        jpeg.image_width = width;
        jpeg.image_height = height;
        jpeg.input_components = kind->components;
        jpeg.in_color_space = colours[kind->components];
        jpeg_set_defaults(&jpeg);
        jpeg_set_quality(&jpeg, kind->quality, TRUE);
        jpeg.arith_code = kind->arithmetic ? TRUE : FALSE;
        if (kind->progressive == 1) jpeg_simple_progression(&jpeg);
        if (kind->progressive == 2) jpeg.scan_info = two, jpeg.num_scans = 2;
        if (!kind->subsampled) jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = 1;
        jpeg_start_compress(&jpeg, TRUE);
        while (jpeg.next_scanline < height) {
            JSAMPROW row = (JSAMPROW)pixels + (size_t)jpeg.next_scanline * width * (size_t)kind->components;
            jpeg_write_scanlines(&jpeg, &row, 1);
        }
        jpeg_finish_compress(&jpeg);
    } else {
        free(bytes);
        bytes = NULL;
    }
    jpeg_destroy_compress(&jpeg);
    *out_size = size;
    return bytes;
}
