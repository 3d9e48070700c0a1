/* test_scene.c -- the scene description by the public calls: defaults, every refusal with its words, ownership. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "scene.h"
#include "strategy.h"

typedef struct fixture {
    brume_context *context;
    brume_scene *scene;
    uint32_t texture, bsdf, medium;
} fixture;

static int setup(void **state) {
    fixture *f = calloc(1, sizeof *f);
    const float texels[3] = {0.5f, 0.5f, 0.5f};
    brume_texture_desc texture = brume_texture_desc_default();
    brume_bsdf_desc bsdf = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    brume_medium_desc medium = brume_medium_desc_default();
    texture.width = texture.height = 1;
    texture.texels = texels;
    assert_non_null(f);
    assert_int_equal(brume_context_create(&f->context), BRUME_OK);
    assert_int_equal(brume_scene_create(f->context, &f->scene), BRUME_OK);
    assert_int_equal(brume_scene_add_texture(f->scene, &texture, &f->texture), BRUME_OK);
    assert_int_equal(brume_scene_add_bsdf(f->scene, &bsdf, &f->bsdf), BRUME_OK);
    assert_int_equal(brume_scene_add_medium(f->scene, &medium, &f->medium), BRUME_OK);
    *state = f;
    return 0;
}

static int teardown(void **state) {
    fixture *f = *state;
    brume_context_destroy(f->context);
    brume_scene_destroy(f->scene);
    free(f);
    return 0;
}

static uint32_t parts(const brume_scene *s) {
    return s->texture_count + s->bsdf_count + s->medium_count + s->light_count + s->shape_count;
}

/* The call is refused as an argument error that says `words`, and nothing was added and no id given out. */
#define REFUSED(call, words)                                                                                           \
    do {                                                                                                               \
        uint32_t id = 12345, before = parts(f->scene);                                                                 \
        brume_result refused_result = (call);                                                                          \
        const char *said = brume_context_message(f->context);                                                          \
        if (refused_result != BRUME_ERROR_ARGUMENT || !strstr(said, words))                                            \
            fail_msg("%s: result %d, message \"%s\", expected \"%s\"", #call, refused_result, said, words);            \
        assert_int_equal(id, 12345);                                                                                   \
        assert_int_equal(parts(f->scene), before);                                                                     \
    } while (0)

#define DESC_WITH(type, kind_or_nothing, change)                  \
    brume_##type##_desc d = brume_##type##_desc_default kind_or_nothing; \
    change;

#define BAD(type, kind_or_nothing, change, words)                            \
    do {                                                                     \
        DESC_WITH(type, kind_or_nothing, change)                             \
        REFUSED(brume_scene_add_##type(f->scene, &d, &id), words);           \
    } while (0)

#define BAD_SET(type, change, words)                                         \
    do {                                                                     \
        DESC_WITH(type, (), change)                                          \
        REFUSED(((void)id, brume_scene_set_##type(f->scene, &d)), words);    \
    } while (0)

static void test_textures(void **state) {
    fixture *f = *state;
    static const float texels[12] = {0.1f, 0.2f, 0.3f, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    static const float negative[3] = {0, -1, 0}, nan_texel[6] = {0, 0, 0, 0, 0, NAN};
    BAD(texture, (), d.cookie = 0, "brume_texture_desc_default");
    BAD(texture, (), memset(&d, 0, sizeof d), "brume_texture_desc_default");
    BAD(texture, (), d.kind = (brume_texture_kind)7, "kind 7");
    BAD(texture, (), d.filter = (brume_texture_filter)-1, "filter -1");
    BAD(texture, (), d.wrap = (brume_texture_wrap)3, "wrap 3");
    BAD(texture, (), d.texels = texels, "0 x 0");
    BAD(texture, (), (d.width = 2, d.texels = texels), "2 x 0");
    BAD(texture, (), d.width = d.height = 2, "texels is NULL");
    BAD(texture, (), (d.width = d.height = 65536, d.texels = texels), "too many");
    BAD(texture, (), (d.width = d.height = UINT32_MAX, d.texels = texels), "too many");
    BAD(texture, (), (d.width = d.height = 1, d.texels = negative), "texel (0, 0) is negative");
    BAD(texture, (), (d.width = 1, d.height = 2, d.texels = nan_texel), "texel (0, 1)");
    BAD(texture, (), (d.width = d.height = 1, d.texels = texels, d.to_uv[3] = INFINITY), "to_uv");
    BAD(texture, (), (d.kind = BRUME_TEXTURE_CHECKERBOARD, d.color1[2] = NAN), "colours");
    REFUSED(brume_scene_add_texture(f->scene, NULL, &id), "NULL");

    float *copied = malloc(sizeof texels);
    uint32_t id;
    memcpy(copied, texels, sizeof texels);
    brume_texture_desc d = brume_texture_desc_default();
    d.width = d.height = 2;
    d.texels = copied;
    assert_int_equal(brume_scene_add_texture(f->scene, &d, &id), BRUME_OK);
    memset(copied, 0xff, sizeof texels);
    free(copied);
    assert_int_equal(id, 1);
    assert_memory_equal(f->scene->textures[id].texels, texels, sizeof texels);
}

static void test_bsdfs(void **state) {
    fixture *f = *state;
    uint32_t glass;
    brume_bsdf_desc dielectric = brume_bsdf_desc_default(BRUME_BSDF_DIELECTRIC);
    assert_int_equal(brume_scene_add_bsdf(f->scene, &dielectric, &glass), BRUME_OK);
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.cookie++, "brume_bsdf_desc_default");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.kind = (brume_bsdf_kind)6, "kind 6");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.reflectance[0] = 1.5f, "[0, 1]");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.reflectance[2] = -0.1f, "[0, 1]");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.reflectance[1] = NAN, "reflectance");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.reflectance_texture = 1, "no id 1");
    BAD(bsdf, (BRUME_BSDF_DIELECTRIC), d.transmittance[1] = 2, "transmittance");
    BAD(bsdf, (BRUME_BSDF_DIELECTRIC), d.int_ior = 0, "refraction");
    BAD(bsdf, (BRUME_BSDF_DIELECTRIC), d.ext_ior = INFINITY, "refraction");
    BAD(bsdf, (BRUME_BSDF_CONDUCTOR), d.eta[0] = -1, "eta and k");
    BAD(bsdf, (BRUME_BSDF_CONDUCTOR), d.k[0] = NAN, "eta and k");
    BAD(bsdf, (BRUME_BSDF_ROUGH_CONDUCTOR), d.distribution = (brume_distribution)2, "distribution 2");
    BAD(bsdf, (BRUME_BSDF_ROUGH_CONDUCTOR), d.alpha_u = 0, "roughness");
    BAD(bsdf, (BRUME_BSDF_ROUGH_CONDUCTOR), d.alpha_v = NAN, "roughness");
    BAD(bsdf, (BRUME_BSDF_DIELECTRIC), d.two_sided = 1, "two-sided");
    BAD(bsdf, (BRUME_BSDF_NULL), d.two_sided = 1, "two-sided");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), d.back = 0, "not two_sided");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), (d.two_sided = 1, d.back = 2), "no id 2");
    BAD(bsdf, (BRUME_BSDF_DIFFUSE), (d.two_sided = 1, d.back = glass), "bsdf 1 is not");
    REFUSED(brume_scene_add_bsdf(f->scene, NULL, &id), "NULL");
}

static void test_media(void **state) {
    fixture *f = *state;
    BAD(medium, (), d.cookie = 1, "brume_medium_desc_default");
    BAD(medium, (), d.sigma_t[0] = -1, "sigma_t");
    BAD(medium, (), d.sigma_t[2] = INFINITY, "sigma_t");
    BAD(medium, (), d.albedo[1] = 1.01f, "albedo");
    BAD(medium, (), d.albedo[1] = NAN, "albedo");
    BAD(medium, (), d.emission[0] = -0.5f, "emission");
    BAD(medium, (), d.g = 1, "g must");
    BAD(medium, (), d.g = -1, "g must");
    BAD(medium, (), d.g = 1.5f, "g must");
    BAD(medium, (), d.g = -1.5f, "g must");
    BAD(medium, (), d.g = INFINITY, "g must");
    BAD(medium, (), d.g = NAN, "g must");
    REFUSED(brume_scene_add_medium(f->scene, NULL, &id), "NULL");
}

static void test_lights(void **state) {
    fixture *f = *state;
    static const float texels[3] = {1, 1, 1}, bad[3] = {1, 1, INFINITY};
    BAD(light, (BRUME_LIGHT_POINT), d.cookie = 0, "brume_light_desc_default");
    BAD(light, ((brume_light_kind)9), (void)0, "kind 9");
    BAD(light, (BRUME_LIGHT_POINT), d.to_world[3] = NAN, "NaN");
    BAD(light, (BRUME_LIGHT_POINT), d.to_world[15] = 2, "affine");
    BAD(light, (BRUME_LIGHT_DIRECTIONAL), memset(d.to_world, 0, 12 * sizeof(float)), "singular");
    BAD(light, (BRUME_LIGHT_SPOT), d.to_world[0] = 2, "evenly");
    BAD(light, (BRUME_LIGHT_SPOT), d.to_world[1] = 0.5f, "evenly");
    BAD(light, (BRUME_LIGHT_POINT), d.intensity[0] = -1, "intensity");
    BAD(light, (BRUME_LIGHT_SPOT), d.cutoff_angle = 0, "cutoff_angle");
    BAD(light, (BRUME_LIGHT_SPOT), d.cutoff_angle = 180.5f, "cutoff_angle");
    BAD(light, (BRUME_LIGHT_SPOT), d.cutoff_angle = NAN, "cutoff_angle");
    BAD(light, (BRUME_LIGHT_SPOT), d.beam_width = 21, "beam_width");
    BAD(light, (BRUME_LIGHT_SPOT), d.beam_width = NAN, "beam_width");
    BAD(light, (BRUME_LIGHT_SPOT), d.texture = 9, "no id 9");
    BAD(light, (BRUME_LIGHT_SPOT), (d.texture = 0, d.cutoff_angle = 90), "below 90");
    BAD(light, (BRUME_LIGHT_POINT), d.texture = 0, "only spots");
    BAD(light, (BRUME_LIGHT_ENVMAP), (void)0, "0 x 0");
    BAD(light, (BRUME_LIGHT_ENVMAP), d.width = d.height = 1, "texels is NULL");
    BAD(light, (BRUME_LIGHT_ENVMAP), (d.width = d.height = 1, d.texels = bad), "texel (0, 0)");
    BAD(light, (BRUME_LIGHT_ENVMAP), (d.width = d.height = 1, d.texels = texels, d.scale = -1), "scale");
    BAD(light, (BRUME_LIGHT_ENVMAP), (d.width = d.height = 1, d.texels = texels, d.to_world[5] = 3), "evenly");
    REFUSED(brume_scene_add_light(f->scene, NULL, &id), "NULL");

    brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
    spot.cutoff_angle = 180;
    assert_int_equal(brume_scene_add_light(f->scene, &spot, NULL), BRUME_OK);
    assert_float_equal(f->scene->lights[0].desc.beam_width, 135, 0);
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
    assert_int_equal(brume_scene_add_light(f->scene, &sky, NULL), BRUME_OK);
    BAD(light, (BRUME_LIGHT_CONSTANT), (void)0, "(light 1) already");
    BAD(light, (BRUME_LIGHT_ENVMAP), (d.width = d.height = 1, d.texels = texels), "already");
}

static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
static const float nan_positions[9] = {0, 0, 0, 1, 0, 0, 0, NAN, 0};
static const uint32_t corners[3] = {0, 1, 2}, beyond[6] = {0, 1, 2, 0, 1, 3};

static void as_triangle(brume_shape_desc *d) {
    d->vertex_count = 3;
    d->positions = triangle;
    d->triangle_count = 1;
    d->triangles = corners;
}

static void test_shapes(void **state) {
    fixture *f = *state;
    static const float nan_normals[9] = {NAN};
    static const float nan_uvs[6] = {0, 0, 0, 0, 0, INFINITY};
    BAD(shape, (BRUME_SHAPE_CUBE), d.cookie = 0, "brume_shape_desc_default");
    BAD(shape, ((brume_shape_kind)5), (void)0, "kind 5");
    BAD(shape, (BRUME_SHAPE_MESH), (void)0, "empty");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.triangle_count = 0), "empty");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.vertex_count = UINT32_MAX), "too large");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.positions = NULL), "positions are NULL");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.triangles = NULL), "triangles are NULL");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.positions = nan_positions), "position of vertex 2");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.normals = nan_normals), "normal of vertex 0");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.uvs = nan_uvs), "coordinates of vertex 2");
    BAD(shape, (BRUME_SHAPE_MESH), (as_triangle(&d), d.triangle_count = 2, d.triangles = beyond),
        "triangle 1 names vertex 3");
    BAD(shape, (BRUME_SHAPE_RECTANGLE), d.to_world[10] = 0, "singular");
    BAD(shape, (BRUME_SHAPE_RECTANGLE), d.to_world[5] = NAN, "NaN");
    BAD(shape, (BRUME_SHAPE_RECTANGLE), d.to_world[12] = 1, "affine");
    BAD(shape, (BRUME_SHAPE_SPHERE), d.to_world[10] = 2, "evenly");
    BAD(shape, (BRUME_SHAPE_SPHERE), d.to_world[1] = 0.1f, "evenly");
    BAD(shape, (BRUME_SHAPE_SPHERE), d.center[1] = NAN, "center");
    BAD(shape, (BRUME_SHAPE_SPHERE), d.radius = 0, "radius");
    BAD(shape, (BRUME_SHAPE_SPHERE), d.radius = -1, "radius");
    BAD(shape, (BRUME_SHAPE_SPHERE), d.radius = INFINITY, "radius");
    BAD(shape, (BRUME_SHAPE_DISK), d.radiance[0] = -1, "radiance");
    BAD(shape, (BRUME_SHAPE_DISK), d.bsdf = 1, "bsdf: there is no id 1");
    BAD(shape, (BRUME_SHAPE_DISK), d.interior = 1, "interior: there is no id 1");
    BAD(shape, (BRUME_SHAPE_DISK), d.exterior = 77, "exterior: there is no id 77");
    REFUSED(brume_scene_add_shape(f->scene, NULL, &id), "NULL");

    /* A sphere may be turned, scaled evenly and mirrored; anything else may be scaled as one likes, however small. */
    brume_shape_desc sphere = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    sphere.to_world[0] = -1e-6f, sphere.to_world[5] = 1e-6f, sphere.to_world[10] = 1e-6f;
    assert_int_equal(brume_scene_add_shape(f->scene, &sphere, NULL), BRUME_OK);
    brume_shape_desc tiny = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    tiny.to_world[0] = 1e-5f, tiny.to_world[5] = 1e5f;
    tiny.interior = f->medium;
    uint32_t id;
    assert_int_equal(brume_scene_add_shape(f->scene, &tiny, &id), BRUME_OK);
    assert_int_equal(id, 1);
    assert_int_equal(f->scene->shapes[1].desc.kind, BRUME_SHAPE_MESH);
    assert_int_equal(f->scene->shapes[1].desc.triangle_count, 2);
    assert_true(f->scene->shapes[1].desc.is_boundary);
    assert_false(f->scene->shapes[0].desc.is_boundary);
}

static void test_sensor(void **state) {
    fixture *f = *state;
    BAD_SET(sensor, d.cookie = 0, "brume_sensor_desc_default");
    BAD_SET(sensor, d.to_world[0] = 2, "evenly");
    BAD_SET(sensor, d.to_world[0] = d.to_world[5] = d.to_world[10] = 2, "must not scale");
    BAD_SET(sensor, d.to_world[0] = NAN, "NaN");
    BAD_SET(sensor, d.fov = 0, "fov");
    BAD_SET(sensor, d.fov = 180, "fov");
    BAD_SET(sensor, d.fov = NAN, "fov");
    BAD_SET(sensor, d.fov_axis = (brume_fov_axis)5, "fov_axis 5");
    BAD_SET(sensor, d.near_clip = 0, "near_clip");
    BAD_SET(sensor, d.near_clip = 10000, "near_clip");
    BAD_SET(sensor, d.far_clip = INFINITY, "far_clip");
    BAD_SET(sensor, d.aperture_radius = -1, "aperture_radius");
    BAD_SET(sensor, (d.aperture_radius = 1, d.focus_distance = 0), "focus_distance");
    BAD_SET(sensor, d.medium = 1, "no id 1");
    assert_false(f->scene->has_sensor);
    brume_sensor_desc d = brume_sensor_desc_default();
    assert_int_equal(brume_scene_set_sensor(f->scene, NULL), BRUME_ERROR_ARGUMENT);
    d.to_world[0] = -1; /* mirrored pictures are allowed */
    assert_int_equal(brume_scene_set_sensor(f->scene, &d), BRUME_OK);
    assert_true(f->scene->has_sensor);
}

static void test_film(void **state) {
    fixture *f = *state;
    BAD_SET(film, d.cookie = 0, "brume_film_desc_default");
    BAD_SET(film, d.width = 0, "[1, 65536]");
    BAD_SET(film, d.height = 65537, "[1, 65536]");
    BAD_SET(film, d.crop_x = 768, "leaves the film");
    BAD_SET(film, (d.crop_y = 1, d.crop_height = 576), "leaves the film");
    BAD_SET(film, (d.crop_x = 767, d.crop_width = UINT32_MAX), "leaves the film");
    BAD_SET(film, d.rfilter = (brume_rfilter)6, "rfilter 6");
    BAD_SET(film, d.filter_radius = -1, "filter_radius");
    BAD_SET(film, d.filter_radius = NAN, "filter_radius");
    BAD_SET(film, d.filter_stddev = 0, "filter_stddev");
    BAD_SET(film, (d.rfilter = BRUME_RFILTER_MITCHELL, d.filter_b = 2), "filter_b");
    BAD_SET(film, (d.rfilter = BRUME_RFILTER_LANCZOS, d.filter_lobes = 0), "filter_lobes");
    brume_film_desc d;
    assert_int_equal(brume_scene_get_film(f->scene, &d), BRUME_OK);
    assert_int_equal(d.width, 768);
    assert_int_equal(d.height, 576);
    d.width = d.height = 1;
    assert_int_equal(brume_scene_set_film(f->scene, &d), BRUME_OK);
    assert_int_equal(brume_scene_get_film(f->scene, &d), BRUME_OK);
    assert_int_equal(d.width, 1);
    assert_int_equal(brume_scene_get_film(f->scene, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_get_film(NULL, &d), BRUME_ERROR_ARGUMENT);
}

/* Names are those of brume.h's comments, in both directions; nothing else is one. */
static void test_strategy_names(void **state) {
    static const char *const names[] = {"auto", "spherical", "distance", "equiangular", "equiangular-cone", "mis",
                                        "product", "systematic", "raster"};
    static const char *const indirects[] = {"auto", "phase", "mixture", "ray-lights"};
    static const char *const wrong[] = {"", "Auto", "auto ", "raste", "rasters", "equiangular_cone", "ray-light"};
    brume_strategy strategy = BRUME_STRATEGY_MIS;
    brume_indirect indirect = BRUME_INDIRECT_MIXTURE;
    (void)state;
    for (int i = 0; i < 9; i++) {
        assert_string_equal(brume_strategy_name((brume_strategy)i), names[i]);
        assert_true(brume_strategy_find(names[i], &strategy) && (int)strategy == i);
    }
    for (int i = 0; i < 4; i++) {
        assert_string_equal(brume_indirect_name((brume_indirect)i), indirects[i]);
        assert_true(brume_indirect_find(indirects[i], &indirect) && (int)indirect == i);
    }
    assert_null(brume_strategy_name((brume_strategy)9));
    assert_null(brume_strategy_name((brume_strategy)-1));
    assert_null(brume_indirect_name((brume_indirect)4));
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_false(brume_strategy_find(wrong[i], &strategy));
        assert_false(brume_indirect_find(wrong[i], &indirect));
    }
    /* untouched by what isn't found */
    assert_int_equal(strategy, BRUME_STRATEGY_RASTER);
    assert_int_equal(indirect, BRUME_INDIRECT_RAY_LIGHTS);
    for (uint32_t n = 0; n <= 200; n++) {
        int valid = n == 0 || n == 1 || n == 2 || n == 4 || n == 8 || n == 16 || n == 32 || n == 64;
        assert_int_equal(brume_positions_valid(n) != 0, valid);
    }
}

static void test_integrator(void **state) {
    fixture *f = *state;
    BAD_SET(integrator, d.cookie = 0, "brume_integrator_desc_default");
    BAD_SET(integrator, d.max_depth = -2, "max_depth");
    BAD_SET(integrator, d.rr_depth = 0, "rr_depth");
    BAD_SET(integrator, d.sampler = (brume_sampler)2, "sampler 2");
    BAD_SET(integrator, d.sample_count = 0, "sample_count");
    BAD_SET(integrator, d.strategy = (brume_strategy)9, "strategy 9");
    BAD_SET(integrator, d.strategy = (brume_strategy)-1, "strategy -1");
    BAD_SET(integrator, d.positions = 3, "positions");
    BAD_SET(integrator, d.positions = 128, "positions");
    BAD_SET(integrator, d.indirect = (brume_indirect)4, "indirect 4");
    brume_integrator_desc d;
    assert_int_equal(brume_scene_get_integrator(f->scene, &d), BRUME_OK);
    assert_int_equal(d.max_depth, -1);
    assert_int_equal(d.sample_count, 16);
    d.max_depth = 0;
    assert_int_equal(brume_scene_set_integrator(f->scene, &d), BRUME_OK);
    assert_int_equal(brume_scene_get_integrator(f->scene, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_get_integrator(NULL, &d), BRUME_ERROR_ARGUMENT);
}

/* Every default descriptor is taken as it is, wherever it needs no data. */
static void test_defaults_are_accepted(void **state) {
    fixture *f = *state;
    for (int kind = 0; kind <= BRUME_BSDF_THIN_DIELECTRIC; kind++) {
        brume_bsdf_desc d = brume_bsdf_desc_default((brume_bsdf_kind)kind);
        assert_int_equal(d.kind, kind);
        assert_int_equal(brume_scene_add_bsdf(f->scene, &d, NULL), BRUME_OK);
    }
    for (int kind = 0; kind <= BRUME_LIGHT_CONSTANT; kind++) {
        brume_light_desc d = brume_light_desc_default((brume_light_kind)kind);
        assert_int_equal(brume_scene_add_light(f->scene, &d, NULL), BRUME_OK);
    }
    for (int kind = BRUME_SHAPE_RECTANGLE; kind <= BRUME_SHAPE_DISK; kind++) {
        brume_shape_desc d = brume_shape_desc_default((brume_shape_kind)kind);
        assert_int_equal(brume_scene_add_shape(f->scene, &d, NULL), BRUME_OK);
    }
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_film_desc film = brume_film_desc_default();
    brume_integrator_desc integrator = brume_integrator_desc_default();
    assert_int_equal(brume_scene_set_sensor(f->scene, &sensor), BRUME_OK);
    assert_int_equal(brume_scene_set_film(f->scene, &film), BRUME_OK);
    assert_int_equal(brume_scene_set_integrator(f->scene, &integrator), BRUME_OK);
}

/* The numbers are those of brume.h. */
static void test_default_values(void **state) {
    (void)state;
    brume_texture_desc texture = brume_texture_desc_default();
    assert_float_equal(texture.color0[1], 0.4f, 0);
    assert_float_equal(texture.color1[1], 0.2f, 0);
    assert_float_equal(texture.to_uv[0] + texture.to_uv[4], 2, 0);
    assert_float_equal(brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE).reflectance[2], 0.5f, 0);
    assert_float_equal(brume_bsdf_desc_default(BRUME_BSDF_CONDUCTOR).reflectance[2], 1, 0);
    assert_float_equal(brume_bsdf_desc_default(BRUME_BSDF_DIELECTRIC).int_ior, 1.5046f, 0);
    assert_float_equal(brume_medium_desc_default().albedo[0], 0.75f, 0);
    assert_float_equal(brume_light_desc_default(BRUME_LIGHT_SPOT).cutoff_angle, 20, 0);
    assert_int_equal(brume_shape_desc_default(BRUME_SHAPE_MESH).interior, BRUME_NONE);
    assert_float_equal(brume_sensor_desc_default().fov, 39.3077f, 0);
    assert_int_equal(brume_film_desc_default().rfilter, BRUME_RFILTER_GAUSSIAN);
    assert_int_equal(brume_integrator_desc_default().rr_depth, 5);
}

static void test_create_and_destroy(void **state) {
    (void)state;
    brume_context *context;
    brume_scene *scene = (void *)&context, *none = scene;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    assert_int_equal(brume_scene_create(NULL, &scene), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_create(context, NULL), BRUME_ERROR_ARGUMENT);
    assert_ptr_equal(scene, none);
    brume_scene_destroy(NULL);
    brume_bsdf_desc d = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    assert_int_equal(brume_scene_add_bsdf(NULL, &d, NULL), BRUME_ERROR_ARGUMENT);
    /* The context goes first; the scene keeps it alive. */
    assert_int_equal(brume_scene_create(context, &scene), BRUME_OK);
    brume_context_destroy(context);
    d.reflectance[0] = 2;
    assert_int_equal(brume_scene_add_bsdf(scene, &d, NULL), BRUME_ERROR_ARGUMENT);
    brume_scene_destroy(scene);
}

/* Past several doublings of every array. */
static void test_many(void **state) {
    fixture *f = *state;
    brume_shape_desc shape = brume_shape_desc_default(BRUME_SHAPE_MESH);
    as_triangle(&shape);
    for (uint32_t i = 0; i < 1000; i++) {
        uint32_t id;
        shape.radiance[0] = (float)i;
        assert_int_equal(brume_scene_add_shape(f->scene, &shape, &id), BRUME_OK);
        assert_int_equal(id, i);
    }
    for (uint32_t i = 0; i < 1000; i++)
        assert_float_equal(f->scene->shapes[i].desc.radiance[0], i, 0);
}

#define IN_SCENE(test) cmocka_unit_test_setup_teardown(test, setup, teardown)

int main(void) {
    const struct CMUnitTest tests[] = {
        IN_SCENE(test_textures),   IN_SCENE(test_bsdfs),
        IN_SCENE(test_media),      IN_SCENE(test_lights),
        IN_SCENE(test_shapes),     IN_SCENE(test_sensor),
        IN_SCENE(test_film),       IN_SCENE(test_integrator),
        IN_SCENE(test_many),       IN_SCENE(test_defaults_are_accepted),
        cmocka_unit_test(test_default_values), cmocka_unit_test(test_create_and_destroy),
        cmocka_unit_test(test_strategy_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
