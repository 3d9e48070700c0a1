/* denoise.c -- see denoise.h. The functions and numbers are those of OIDN's C interface, which versions 1.4 and 2 share
 * but for one name. */
#include "denoise.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

typedef struct oidn_device oidn_device;
typedef struct oidn_filter oidn_filter;
enum { DEVICE_CPU = 1, FORMAT_FLOAT3 = 3 };

typedef struct oidn {
    oidn_device *(*new_device)(int type);
    void (*commit_device)(oidn_device *);
    void (*release_device)(oidn_device *);
    int (*get_error)(oidn_device *, const char **message);
    oidn_filter *(*new_filter)(oidn_device *, const char *type);
    void (*set_image)(oidn_filter *, const char *name, void *data, int format, size_t width, size_t height,
                      size_t byte_offset, size_t pixel_bytes, size_t row_bytes);
    void (*set_bool)(oidn_filter *, const char *name, bool value);
    void (*commit_filter)(oidn_filter *);
    void (*execute_filter)(oidn_filter *);
    void (*release_filter)(oidn_filter *);
} oidn;

/* Where the loader looks, by the names of each system. */
static const char *const usual[] = {"libOpenImageDenoise.so.2",    "libOpenImageDenoise.so.1",
                                    "libOpenImageDenoise.so",      "libOpenImageDenoise.2.dylib",
                                    "libOpenImageDenoise.dylib",   "OpenImageDenoise.dll"};
enum { USUAL = sizeof usual / sizeof usual[0] };

/* Never closed: its threads live on. Opened again it is the same one. */
static brume_library *open_library(const char *chosen) {
    brume_library *library = chosen ? brume_library_open(chosen) : NULL;
    for (int i = 0; i < USUAL && !library; i++) {
        char path[1024];
        int length = snprintf(path, sizeof path, "%s%s%s", chosen ? chosen : "", chosen ? "/" : "", usual[i]);
        if (length > 0 && (size_t)length < sizeof path) library = brume_library_open(path);
    }
    return library;
}

static brume_result load(brume_context *context, oidn *out) {
    const char *chosen = getenv("BRUME_OIDN");
    if (chosen && !*chosen) chosen = NULL;
    brume_library *library = open_library(chosen);
    if (!library && chosen)
        return brume_fail(context, BRUME_ERROR_DENOISER,
                          "denoising: $BRUME_OIDN is %s, and no Open Image Denoise can be loaded from there", chosen);
    if (!library)
        return brume_fail(context, BRUME_ERROR_DENOISER,
                          "denoising needs Open Image Denoise (%s), which is not installed; $BRUME_OIDN may name it or "
                          "its folder", usual[0]);
    const struct { const char *name; void *at; } functions[] = {
        {"oidnNewDevice", &out->new_device},         {"oidnCommitDevice", &out->commit_device},
        {"oidnReleaseDevice", &out->release_device}, {"oidnGetDeviceError", &out->get_error},
        {"oidnNewFilter", &out->new_filter},         {"oidnSetSharedFilterImage", &out->set_image},
        {"oidnSetFilterBool", &out->set_bool},       {"oidnCommitFilter", &out->commit_filter},
        {"oidnExecuteFilter", &out->execute_filter}, {"oidnReleaseFilter", &out->release_filter}};
    for (size_t i = 0; i < sizeof functions / sizeof functions[0]; i++) {
        void (*function)(void) = brume_library_function(library, functions[i].name);
        if (!function && functions[i].at == (void *)&out->set_bool)
            function = brume_library_function(library, "oidnSetFilter1b"); /* until version 2 */
        if (!function)
            return brume_fail(context, BRUME_ERROR_DENOISER, "denoising: this Open Image Denoise has no %s",
                              functions[i].name);
        memcpy(functions[i].at, &function, sizeof function);
    }
    return BRUME_OK;
}

brume_result brume_denoiser_find(brume_context *context) {
    oidn o;
    return context ? load(context, &o) : BRUME_ERROR_ARGUMENT;
}

static void set_picture(const oidn *o, oidn_filter *filter, const char *name, const float *data, uint32_t width,
                        uint32_t height) {
    if (data) o->set_image(filter, name, (void *)(size_t)data, FORMAT_FLOAT3, width, height, 0, 0, 0);
}

brume_result brume_denoise_picture(brume_context *context, uint32_t width, uint32_t height, const float *rgb,
                                   const float *albedo, const float *normal, float *out) {
    oidn o;
    BRUME_TRY(load(context, &o));
    oidn_device *device = o.new_device(DEVICE_CPU);
    const char *message = NULL;
    if (!device) {
        o.get_error(NULL, &message);
        return brume_fail(context, BRUME_ERROR_DENOISER, "denoising: %s", message ? message : "no device");
    }
    o.commit_device(device);
    oidn_filter *filter = o.new_filter(device, "RT");
    if (filter) {
        set_picture(&o, filter, "color", rgb, width, height);
        set_picture(&o, filter, "albedo", albedo, width, height);
        set_picture(&o, filter, "normal", normal, width, height);
        set_picture(&o, filter, "output", out, width, height);
        o.set_bool(filter, "hdr", true);
        o.commit_filter(filter);
        o.execute_filter(filter);
        o.release_filter(filter);
    }
    brume_result result = BRUME_OK;
    if (o.get_error(device, &message) != 0 || !filter)
        result = brume_fail(context, BRUME_ERROR_DENOISER, "denoising: %s", message ? message : "no filter");
    o.release_device(device);
    return result;
}
