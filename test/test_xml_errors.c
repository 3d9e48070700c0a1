/* Wrong scene files: each must fail with exactly the expected line, and no file whatsoever may do worse than fail. */
#include "brume.h"
#include "scene_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define BSDF(type, body) SCENE("<bsdf type=\"" type "\">\n  " body "</bsdf>")
#define EMITTER(type, body) SCENE("<emitter type=\"" type "\">\n  " body "</emitter>")
#define SHAPE(type, body) SCENE("<shape type=\"" type "\">\n  " body "</shape>")
#define MEDIUM(body) SCENE("<medium type=\"homogeneous\">\n  " body "</medium>")
#define SENSOR(type, body) SCENE("<sensor type=\"" type "\">\n  " body "</sensor>")
#define FILM(body) SENSOR("perspective", "<film type=\"hdrfilm\">\n    " body "</film>")
#define SAMPLER(type, body) SENSOR("perspective", "<sampler type=\"" type "\">\n    " body "</sampler>")
#define INTEGRATOR(type, body) SCENE("<integrator type=\"" type "\">\n  " body "</integrator>")
#define TRANSFORM(body) EMITTER("spot", "<transform name=\"to_world\">\n    " body "</transform>")
#define TEXTURE(type, body) SCENE("<texture type=\"" type "\">\n  " body "</texture>")
#define V(tag, name, value) "<" tag " name=\"" name "\" value=\"" value "\"/>"

typedef struct bad_file {
    const char *text, *expected;
} bad_file;

static const bad_file bad_files[] = {
    /* the file */
    {"", "scene.xml:1:1: no element found"},
    {"<scene version=\"3.0.0\">\n", "scene.xml:2:1: no element found"},
    {"<scene version=\"3.0.0\">\n  </bsdf>", "scene.xml:2:5: mismatched tag"},
    {"<scene version=\"3.0.0\"\n  <bsdf/></scene>", "scene.xml:2:3: not well-formed (invalid token)"},
    {"<scene version=\"3.0.0\"/>\n<scene version=\"3.0.0\"/>", "scene.xml:2:1: junk after document element"},
    {SCENE("&lol;"), "scene.xml:2:1: undefined entity"},
    {"<?xml version=\"1.0\"?>\n<!DOCTYPE scene [<!ENTITY a \"b\">]>\n<scene version=\"3.0.0\"/>",
     "scene.xml:2:17: a document type declaration is not allowed"},
    {"<!DOCTYPE scene SYSTEM \"file:///etc/passwd\">\n<scene version=\"3.0.0\"/>",
     "scene.xml:1:44: a document type declaration is not allowed"},
    {"<scene/>", "scene.xml:1:1: the root element <scene> needs the attribute 'version'"},
    {"<scene version=\"three\"/>", "scene.xml:1:1: the version 'three' is not of the form 3.0.0"},
    {"<scene version=\"3.0\"/>", "scene.xml:1:1: the version '3.0' is not of the form 3.0.0"},
    {"<scene version=\"4.0.0\"/>", "scene.xml:1:1: version 4.0.0 is newer than this reader, which knows 3.x"},
    {"<scene version=\"3.0.0\" foo=\"1\"/>", "scene.xml:1:1: unexpected attribute 'foo' in <scene>"},
    {"<bsdf version=\"3.0.0\" type=\"diffuse\"/>", "scene.xml:1:1: the root element must be <scene>, not <bsdf>"},
    {SCENE("  stray"), "scene.xml:2:1: text outside of elements' attributes has no meaning here"},
    {SCENE("<bsdf/>"), "scene.xml:2:1: <bsdf> needs the attribute 'type'"},
    {SCENE("<bsfd type=\"diffuse\"/>"), "scene.xml:2:1: unknown element <bsfd>; did you mean <bsdf>?"},
    {SCENE("<zebra/>"), "scene.xml:2:1: unknown element <zebra>"},
    {SCENE("<bsdf type=\"diffuse\" colour=\"red\"/>"), "scene.xml:2:1: unexpected attribute 'colour' in <bsdf>"},
    {SCENE(V("float", "x", "1")), "scene.xml:2:1: unknown property 'x' of scene"},

    /* parameters, includes, references */
    {BSDF("diffuse", V("float", "reflectance", "$r")), "scene.xml:3:3: undefined parameter: $r"},
    {SCENE("<default name=\"a\"/>"), "scene.xml:2:1: <default> needs the attribute 'value'"},
    {SCENE("<default name=\"\" value=\"1\"/>"), "scene.xml:2:1: the name of a <default> must not be empty"},
    {SCENE("<default name=\"a\" value=\"1\"><bsdf type=\"null\"/></default>"),
     "scene.xml:2:29: <bsdf> can't be inside <default>"},
    {SCENE("<include filename=\"none.xml\"/>"), "scene.xml:2:1: cannot open 'none.xml': No such file or directory"},
    {SCENE("<include file=\"none.xml\"/>"), "scene.xml:2:1: unexpected attribute 'file' in <include>"},
    {SCENE("<include filename=\"scene.xml\"/>"), "scene.xml:2:1: 'scene.xml' includes itself"},
    {SCENE("<include filename=\"broken.xml\"/>"), "broken.xml:2:3: unknown property 'alhpa' of diffuse"},
    {SCENE("<path value=\"nowhere\"/>"), "scene.xml:2:1: the folder 'nowhere' does not exist"},
    {BSDF("diffuse", "<path value=\".\"/>"), "scene.xml:3:3: <path> must be a child of the root element"},
    {SCENE("<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"null\" id=\"a\"/>"),
     "scene.xml:3:1: the id 'a' is already taken (scene.xml:2:1)"},
    {SCENE("<bsdf type=\"diffuse\" id=\"\"/>"), "scene.xml:2:1: an id must not be empty"},
    {SHAPE("cube", "<ref id=\"glass\"/>"), "scene.xml:3:3: there is no object with the id 'glass'"},
    {SCENE("<bsdf type=\"null\" id=\"glass\"/><shape type=\"cube\">\n<ref id=\"galss\"/></shape>"),
     "scene.xml:3:1: there is no object with the id 'galss'; did you mean 'glass'?"},
    {SHAPE("cube", "<ref name=\"bsdf\"/>"), "scene.xml:3:3: <ref> needs the attribute 'id'"},
    {SCENE("<bsdf type=\"null\" id=\"a\"/><ref id=\"a\"/>"), "scene.xml:2:27: a <ref> at the top level has no effect"},
    {SCENE("<alias id=\"a\" as=\"b\"/>"), "scene.xml:2:1: there is no object with the id 'a' before this alias"},
    {SCENE("<alias id=\"a\"/>"), "scene.xml:2:1: <alias> needs the attributes 'id' and 'as', and no others"},
    {SCENE("<bsdf type=\"twosided\" id=\"a\"><bsdf type=\"diffuse\"/><ref id=\"a\"/></bsdf>"),
     "scene.xml:2:52: a twosided can't hold a twosided"},

    /* values */
    {BSDF("diffuse", "<float value=\"1\"/>"), "scene.xml:3:3: <float> needs the attribute 'name'"},
    {BSDF("diffuse", "<float name=\"reflectance\"/>"), "scene.xml:3:3: <float> needs the attribute 'value'"},
    {BSDF("diffuse", "<float name=\"reflectance\" value=\".1\" unit=\"m\"/>"),
     "scene.xml:3:3: unexpected attribute 'unit' in <float>"},
    {BSDF("diffuse", "<float name=\"reflectance\" value=\".1\">\n<bsdf type=\"null\"/></float>"),
     "scene.xml:4:1: <bsdf> can't be inside <float>"},
    {BSDF("diffuse", V("float", "reflectance", "0.5x")), "scene.xml:3:3: '0.5x' is not a number"},
    {BSDF("diffuse", V("float", "reflectance", "0x1p-1")), "scene.xml:3:3: '0x1p-1' is not a number"},
    {BSDF("diffuse", V("float", "reflectance", "nan")), "scene.xml:3:3: 'nan' is not a number"},
    {BSDF("diffuse", V("float", "reflectance", "1e999")), "scene.xml:3:3: '1e999' is not a number"},
    {BSDF("diffuse", V("float", "reflectance", "")), "scene.xml:3:3: '' is not a number"},
    {BSDF("diffuse", V("float", "reflectance", "0,5")), "scene.xml:3:3: '0,5' is not a number"},
    {BSDF("diffuse", V("string", "reflectance", "red")),
     "scene.xml:3:3: property 'reflectance' of diffuse must be a colour, not a <string>"},
    {BSDF("diffuse", V("rgb", "reflectance", "0.1 0.2")), "scene.xml:3:3: '0.1 0.2' is not one or three numbers"},
    {BSDF("diffuse", V("rgb", "reflectance", "0.1;0.2;0.3")),
     "scene.xml:3:3: '0.1;0.2;0.3' is not one or three numbers"},
    {BSDF("diffuse", V("rgb", "reflectance", "0.1 0.2 1.3")),
     "scene.xml:3:3: property 'reflectance' of diffuse must be in [0, 1]"},
    {BSDF("diffuse", V("rgb", "reflectance", "0.1 -0.2 0.3")),
     "scene.xml:3:3: property 'reflectance' of diffuse must not be negative"},
    {BSDF("diffuse", V("spectrum", "reflectance", "400:0.1 500")),
     "scene.xml:3:3: '400:0.1 500' is not a list of wavelength:value pairs"},
    {BSDF("diffuse", V("spectrum", "reflectance", "500:0.1, 400:0.2")),
     "scene.xml:3:3: a spectrum's wavelengths must ascend"},
    {BSDF("diffuse", V("spectrum", "reflectance", "500:0.1")),
     "scene.xml:3:3: a spectrum needs two wavelengths at least, or one value for all"},
    {BSDF("diffuse", V("spectrum", "reflectance", "500:0.1 600:-1")),
     "scene.xml:3:3: a spectrum's wavelengths must be positive and its values must not be negative"},
    {BSDF("diffuse", "<spectrum name=\"reflectance\" filename=\"a.spd\"/>"),
     "scene.xml:3:3: <spectrum> files are not supported yet; write the values into 'value'"},
    {BSDF("diffuse", "<spectrum name=\"reflectance\" type=\"d65\"/>"),
     "scene.xml:3:3: the spectrum plugin 'd65' is not supported yet"},
    {BSDF("diffuse", V("float", "reflectance", ".1") V("float", "reflectance", ".2")),
     "scene.xml:3:41: property 'reflectance' is given twice"},
    {EMITTER("point", "<point name=\"position\" x=\"1\" y=\"2\"/>"), "scene.xml:3:3: <point> needs the attribute 'z'"},
    {EMITTER("point", "<point name=\"position\" x=\"1\" y=\"2\" z=\"q\"/>"), "scene.xml:3:3: 'q' is not a number"},
    {EMITTER("point", V("point", "position", "1 2")), "scene.xml:3:3: '1 2' is not one or three numbers"},
    {INTEGRATOR("volpath", V("integer", "max_depth", "1.5")), "scene.xml:3:3: '1.5' is not a whole number"},
    {INTEGRATOR("volpath", V("integer", "max_depth", "99999999999999999999")),
     "scene.xml:3:3: '99999999999999999999' is not a whole number"},
    {INTEGRATOR("volpath", V("float", "max_depth", "2")),
     "scene.xml:3:3: property 'max_depth' of volpath must be an <integer>, not a <float>"},
    {INTEGRATOR("volpath", V("boolean", "hide_emitters", "yes")), "scene.xml:3:3: 'yes' is neither true nor false"},

    /* transforms */
    {TRANSFORM("<rotate y=\"1\"/>"), "scene.xml:4:5: <rotate> needs the attribute 'angle'"},
    {TRANSFORM("<rotate angle=\"1\"/>"), "scene.xml:4:5: the axis of a <rotate> must not be 0"},
    {TRANSFORM("<scale x=\"0\"/>"), "scene.xml:3:3: property 'to_world' of spot must not be singular"},
    {TRANSFORM("<scale value=\"2\" x=\"1\"/>"), "scene.xml:4:5: <scale> has either 'value' or 'x'"},
    {TRANSFORM("<translate w=\"1\"/>"), "scene.xml:4:5: unexpected attribute 'w' in <translate>"},
    {TRANSFORM("<tranlsate x=\"1\"/>"), "scene.xml:4:5: unknown transform <tranlsate>; did you mean <translate>?"},
    {TRANSFORM("<matrix value=\"1 2 3\"/>"), "scene.xml:4:5: '1 2 3' is not 9 or 16 numbers"},
    {TRANSFORM("<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>"),
     "scene.xml:3:3: property 'to_world' of spot must be affine: 0 0 0 1 in the last row"},
    {TRANSFORM("<lookat origin=\"0 0 0\"/>"), "scene.xml:4:5: <lookat> needs the attribute 'target'"},
    {TRANSFORM("<lookat origin=\"0 0 0\" target=\"0 1 0\" up=\"0 1 0\"/>"),
     "scene.xml:4:5: <lookat> needs a target away from the origin, in another direction than up"},
    {EMITTER("spot", V("float", "to_world", "1")),
     "scene.xml:3:3: property 'to_world' of spot must be a <transform>, not a <float>"},
    {EMITTER("spot", "<lookat origin=\"0 0 0\" target=\"0 0 1\"/>"), "scene.xml:3:3: unknown element <lookat>"},

    /* plugins and properties */
    {SCENE("<bsdf type=\"difuse\"/>"), "scene.xml:2:1: unknown bsdf plugin 'difuse'; did you mean 'diffuse'?"},
    {SCENE("<bsdf type=\"plastic\"/>"),
     "scene.xml:2:1: the bsdf plugin 'plastic' is not supported yet"
     "; there are diffuse, dielectric, thindielectric, conductor, roughconductor, "
     "twosided and null"},
    {SCENE("<bsdf type=\"zebra\"/>"),
     "scene.xml:2:1: unknown bsdf plugin 'zebra'"
     "; there are diffuse, dielectric, thindielectric, conductor, roughconductor, "
     "twosided and null"},
    {SCENE("<shape type=\"cylinder\"/>"),
     "scene.xml:2:1: the shape plugin 'cylinder' is not supported yet"
     "; there are obj, ply, rectangle, cube, sphere and disk"},
    {SCENE("<volume type=\"gridvolume\"/>"), "scene.xml:2:1: the volume plugin 'gridvolume' is not supported yet"},
    {EMITTER("spot", V("float", "intenstiy", "3")),
     "scene.xml:3:3: unknown property 'intenstiy' of spot; did you mean 'intensity'?"},
    {EMITTER("spot", V("float", "zebra", "3")), "scene.xml:3:3: unknown property 'zebra' of spot"},
    {BSDF("diffuse", "<film type=\"hdrfilm\"/>"), "scene.xml:3:3: a <film> has no place in diffuse"},
    {BSDF("dielectric", V("string", "int_ior", "watre")),
     "scene.xml:3:3: unknown dielectric 'watre'; did you mean 'water'?"},
    {BSDF("dielectric", V("float", "int_ior", "0")),
     "scene.xml:3:3: property 'int_ior' of dielectric must be positive"},
    {BSDF("dielectric", "<texture name=\"specular_transmittance\" type=\"checkerboard\"/>"),
     "scene.xml:3:3: a <texture> for property 'specular_transmittance' of dielectric is not supported yet"},
    {BSDF("conductor", V("string", "material", "Unobtainium")), "scene.xml:3:3: unknown conductor 'Unobtainium'"},
    {BSDF("conductor", V("string", "material", "Au") V("float", "k", "1")),
     "scene.xml:3:3: property 'material' of conductor must not be given together with eta or k"},
    {BSDF("roughconductor", V("float", "alpha", "0")),
     "scene.xml:3:3: property 'alpha' of roughconductor must be positive"},
    {BSDF("roughconductor", V("float", "alpha_u", "0.1")),
     "scene.xml:3:3: property 'alpha_u' of roughconductor must be given together with its sibling"},
    {BSDF("roughconductor", V("string", "distribution", "phong")),
     "scene.xml:3:3: property 'distribution' of roughconductor must be beckmann or ggx"},
    {BSDF("roughconductor", "<texture name=\"alpha\" type=\"checkerboard\"/>"),
     "scene.xml:3:3: a <texture> for property 'alpha' of roughconductor is not supported yet"},
    {SCENE("<bsdf type=\"twosided\"/>"), "scene.xml:2:1: a twosided needs a <bsdf>"},
    {BSDF("twosided", "<bsdf type=\"null\"/>"), "scene.xml:3:3: a twosided can't hold a null"},
    {TEXTURE("bitmap", V("string", "filename", "a.png") V("string", "wrap_mode", "fold")),
     "scene.xml:3:42: property 'wrap_mode' of bitmap must be repeat, mirror or clamp"},
    {SCENE("<texture type=\"bitmap\"/>"), "scene.xml:2:1: property 'filename' of bitmap must name a picture"},
    {TEXTURE("checkerboard", "<texture name=\"color0\" type=\"checkerboard\"/>"),
     "scene.xml:3:3: a <texture> for property 'color0' of checkerboard is not supported yet"},
    {SCENE("<shape type=\"obj\"/>"), "scene.xml:2:1: property 'filename' of obj must name a mesh"},
    {SHAPE("sphere", V("float", "radius", "-1")), "scene.xml:3:3: property 'radius' of sphere must be positive"},
    {SHAPE("cube", "<bsdf type=\"null\"/><bsdf type=\"null\"/>"), "scene.xml:3:22: a shape has at most one <bsdf>"},
    {SHAPE("cube", "<medium type=\"homogeneous\"/>"),
     "scene.xml:3:3: a medium of a shape must be named interior or exterior"},
    {SHAPE("cube", "<bsdf name=\"interior\" type=\"null\"/>"),
     "scene.xml:3:3: property 'interior' of cube must be a <medium>, not a <bsdf>"},
    {SHAPE("cube", "<emitter type=\"point\"/>"), "scene.xml:3:3: a shape's emitter must be an area emitter, not point"},
    {SHAPE("cube", "<emitter type=\"area\">\n<texture name=\"radiance\" type=\"checkerboard\"/></emitter>"),
     "scene.xml:4:1: a <texture> for property 'radiance' of area is not supported yet"},
    {SCENE("<emitter type=\"area\"/>"), "scene.xml:2:1: an area emitter must be inside a <shape>"},
    {EMITTER("spot", V("float", "cutoff_angle", "0")),
     "scene.xml:3:3: property 'cutoff_angle' of spot must be in (0, 180]"},
    {EMITTER("spot", V("float", "beam_width", "30")),
     "scene.xml:3:3: property 'beam_width' of spot must be in [0, cutoff_angle]"},
    {EMITTER("point", V("point", "position", "1") "<transform name=\"to_world\"/>"),
     "scene.xml:3:3: property 'position' of point must not be given together with to_world"},
    {EMITTER("directional", V("vector", "direction", "0")),
     "scene.xml:3:3: property 'direction' of directional must not be 0"},
    {SCENE("<emitter type=\"constant\"/>\n<emitter type=\"constant\"/>"),
     "scene.xml:3:1: a scene has at most one constant or envmap emitter"},
    {MEDIUM(V("rgb", "albedo", "2")), "scene.xml:3:3: property 'albedo' of homogeneous must be in [0, 1]"},
    {MEDIUM(V("float", "sigma_t", "-1")), "scene.xml:3:3: property 'sigma_t' of homogeneous must not be negative"},
    {MEDIUM(V("float", "sigma_s", "1")),
     "scene.xml:3:3: unknown property 'sigma_s' of homogeneous; did you mean 'sigma_t'?"},
    {MEDIUM("<phase type=\"hg\">" V("float", "g", "1") "</phase>"),
     "scene.xml:3:20: property 'g' of hg must be in (-1, 1)"},
    {MEDIUM("<phase type=\"hg\">" V("float", "g", "-1") "</phase>"),
     "scene.xml:3:20: property 'g' of hg must be in (-1, 1)"},
    {MEDIUM("<phase type=\"hg\">" V("float", "g", "1.5") "</phase>"),
     "scene.xml:3:20: property 'g' of hg must be in (-1, 1)"},
    {MEDIUM("<phase type=\"hg\">" V("float", "g", "0.99999999") "</phase>"), /* 1 as a float */
     "scene.xml:3:20: property 'g' of hg must be in (-1, 1)"},
    {MEDIUM("<phase type=\"hg\">" V("float", "g", "nan") "</phase>"), "scene.xml:3:20: 'nan' is not a number"},
    {MEDIUM("<phase type=\"hg\"/><phase type=\"hg\"/>"), "scene.xml:2:1: a medium has at most one <phase>"},
    {MEDIUM("<volume name=\"albedo\" type=\"gridvolume\"/>"),
     "scene.xml:3:3: a <volume> for property 'albedo' of homogeneous is not supported yet"},
    {SENSOR("perspective", "<transform name=\"to_world\"><scale value=\"2\"/></transform>"),
     "scene.xml:3:3: property 'to_world' of perspective must not scale"},
    {SENSOR("perspective", V("float", "fov", "180")),
     "scene.xml:3:3: property 'fov' of perspective must be in (0, 180)"},
    {SENSOR("perspective", V("string", "fov_axis", "x")),
     "scene.xml:3:3: property 'fov_axis' of perspective must come with a fov"},
    {SENSOR("perspective", V("string", "focal_length", "long")),
     "scene.xml:3:3: property 'focal_length' of perspective must be a length such as 50mm"},
    {SENSOR("perspective", V("float", "near_clip", "0")),
     "scene.xml:3:3: property 'near_clip' of perspective must be positive"},
    {SENSOR("thinlens", ""), "scene.xml:2:1: property 'aperture_radius' of thinlens must be given"},
    {SENSOR("perspective", V("float", "principal_point_offset_x", "0.1")),
     "scene.xml:3:3: property 'principal_point_offset_x' of perspective must be 0; shifted lenses are not supported "
     "yet"},
    {SCENE("<sensor type=\"perspective\"/>\n<sensor type=\"perspective\"/>"),
     "scene.xml:3:1: a second sensor is not supported yet"},
    {SCENE("<film type=\"hdrfilm\"/>"),
     "scene.xml:2:1: this <film> is not used: it belongs into a sensor, or needs a reference from one"},
    {FILM(V("integer", "width", "0")), "scene.xml:4:5: property 'width' of hdrfilm must be in [1, 65536]"},
    {FILM(V("integer", "crop_offset_x", "10")),
     "scene.xml:3:3: the crop of 768 x 576 at (10, 0) leaves the film of 768 x 576"},
    {FILM(V("string", "pixel_format", "xyz")),
     "scene.xml:4:5: property 'pixel_format' of hdrfilm must be rgb or rgba; others are not supported yet"},
    {FILM("<rfilter type=\"gauss\"/>"), "scene.xml:4:5: unknown rfilter plugin 'gauss'; there are box, tent, gaussian, "
                                       "mitchell, catmullrom and lanczos"},
    {FILM("<rfilter type=\"box\">" V("float", "radius", "1") "</rfilter>"),
     "scene.xml:4:25: unknown property 'radius' of box"},
    {SAMPLER("independent", V("integer", "sample_count", "0")),
     "scene.xml:4:5: property 'sample_count' of independent must be in [1, 2147483647]"},
    {SAMPLER("independent", V("boolean", "jitter", "true")), "scene.xml:4:5: unknown property 'jitter' of independent"},
    {INTEGRATOR("path", V("integer", "max_depth", "-2")),
     "scene.xml:3:3: property 'max_depth' of path must be -1 (no limit) or not negative"},
    {INTEGRATOR("direct", V("integer", "max_depth", "2")), "scene.xml:3:3: unknown property 'max_depth' of direct"},
    {INTEGRATOR("volpath", V("string", "strategy", "fast")),
     "scene.xml:3:3: property 'strategy' of volpath must be auto, spherical, distance, equiangular, equiangular-cone, "
     "mis, product, systematic or raster"},
    {INTEGRATOR("volpath", V("integer", "strategy", "8")),
     "scene.xml:3:3: property 'strategy' of volpath must be a <string>, not an <integer>"},
    {INTEGRATOR("volpath", V("string", "stategy", "raster")),
     "scene.xml:3:3: unknown property 'stategy' of volpath; did you mean 'strategy'?"},
    {INTEGRATOR("volpath", V("integer", "positions", "3")),
     "scene.xml:3:3: property 'positions' of volpath must be a power of two up to 64, or 0"},
    {INTEGRATOR("volpath", V("integer", "positions", "128")),
     "scene.xml:3:3: property 'positions' of volpath must be a power of two up to 64, or 0"},
    {INTEGRATOR("volpath", V("integer", "positions", "-1")),
     "scene.xml:3:3: property 'positions' of volpath must be a power of two up to 64, or 0"},
    {INTEGRATOR("volpath", V("integer", "positions", "4294967300")),
     "scene.xml:3:3: property 'positions' of volpath must be a power of two up to 64, or 0"},
    {INTEGRATOR("volpath", V("string", "indirect", "fast")),
     "scene.xml:3:3: property 'indirect' of volpath must be auto, phase, mixture or ray-lights"},
    {SCENE("<integrator type=\"path\"/><integrator type=\"path\"/>"),
     "scene.xml:2:26: a scene has at most one <integrator>"},
    {SCENE("<integrator type=\"aov\"/>"),
     "scene.xml:2:1: the integrator plugin 'aov' is not supported yet; there are path, volpath, volpathmis and direct"},
};

static void test_bad_files(void **state) {
    (void)state;
    brume_context *context;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    scene_files_write_text("broken.xml",
                           "<bsdf version=\"3.0.0\" type=\"diffuse\">\n  <float name=\"alhpa\" value=\"1\"/></bsdf>");
    assert_true(sizeof bad_files / sizeof bad_files[0] >= 50);
    int wrong = 0;
    for (size_t i = 0; i < sizeof bad_files / sizeof bad_files[0]; i++) {
        brume_scene *scene = NULL;
        brume_result result = scene_files_load(context, bad_files[i].text, &scene);
        const char *message = result == BRUME_OK ? "(loaded)" : brume_context_message(context);
        if (result == BRUME_ERROR_SCENE && !scene && strcmp(message, bad_files[i].expected) == 0) continue;
        print_error("%s\nexpected: %s\n     got: %s\n", bad_files[i].text, bad_files[i].expected, message);
        wrong++;
        if (result == BRUME_OK) brume_scene_destroy(scene);
    }
    assert_int_equal(wrong, 0);
    brume_context_destroy(context);
}

/* Lines of other readers, in which only the place is ours. */
static void test_bad_references_to_files(void **state) {
    (void)state;
    static const char *const texts[] = {
        SHAPE("obj", V("string", "filename", "none.obj")), SHAPE("ply", V("string", "filename", "none.ply")),
        TEXTURE("bitmap", V("string", "filename", "none.png")), EMITTER("envmap", V("string", "filename", "none.exr"))};
    brume_context *context;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        brume_scene *scene = NULL;
        assert_int_equal(scene_files_load(context, texts[i], &scene), BRUME_ERROR_SCENE);
        assert_null(scene);
        assert_memory_equal(brume_context_message(context), "scene.xml:2:1: ", 15);
        assert_null(strchr(brume_context_message(context), '\n'));
    }
    brume_context_destroy(context);
}

static void test_arguments(void **state) {
    (void)state;
    brume_context *context;
    brume_scene *scene = NULL;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    scene_files_write_text("scene.xml", "<scene version=\"3.0.0\"/>");
    assert_int_equal(brume_scene_load(NULL, "scene.xml", NULL, 0, &scene), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_load(context, NULL, NULL, 0, &scene), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_load(context, "scene.xml", NULL, 0, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_load(context, "scene.xml", NULL, 1, &scene), BRUME_ERROR_ARGUMENT);
    brume_parameter twice[] = {{"a", "1"}, {"a", "2"}};
    assert_int_equal(brume_scene_load(context, "scene.xml", twice, 2, &scene), BRUME_ERROR_ARGUMENT);
    brume_parameter nameless = {NULL, "1"};
    assert_int_equal(brume_scene_load(context, "scene.xml", &nameless, 1, &scene), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_load(context, "none.xml", NULL, 0, &scene), BRUME_ERROR_SCENE);
    assert_string_equal(brume_context_message(context),
                        "none.xml:1:1: cannot open 'none.xml': No such file or directory");
    assert_int_equal(brume_scene_load(context, ".", NULL, 0, &scene), BRUME_ERROR_SCENE);
    assert_string_equal(brume_context_message(context), ".:1:1: cannot be read: Is a directory");

    scene_files_write_text("scene.xml", "<scene version=\"3.0.0\"><default name=\"mesh\" value=\"1\"/></scene>");
    brume_parameter unused = {"mehs", "1"};
    assert_int_equal(brume_scene_load(context, "scene.xml", &unused, 1, &scene), BRUME_ERROR_SCENE);
    assert_string_equal(brume_context_message(context),
                        "scene.xml:1:1: the parameter 'mehs' is not used; did you mean 'mesh'?");
    assert_null(scene);
    brume_context_destroy(context);
}

/* ---- files made to exhaust -------------------------------------------------------------------------------------- */

static void test_bombs(void **state) {
    (void)state;
    brume_context *context;
    brume_scene *scene = NULL;
    assert_int_equal(brume_context_create(&context), BRUME_OK);

    /* Deep nesting. */
    enum { DEPTH = 5000 };
    static char text[DEPTH * 24 + 64];
    char *c = text;
    c += strlen(strcpy(c, "<scene version=\"3.0.0\">"));
    for (int i = 0; i < DEPTH; i++) c += strlen(strcpy(c, "<bsdf type=\"twosided\">"));
    assert_int_equal(scene_files_load(context, text, &scene), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "elements are nested more than 99 deep"));

    /* Defaults that double each other. */
    c = text;
    c += strlen(strcpy(c, "<scene version=\"3.0.0\">\n<default name=\"a0\" value=\"0123456789\"/>"));
    for (int i = 1; i < 100; i++)
        c += sprintf(c, "<default name=\"a%d_\" value=\"$a%d%s$a%d%s\"/>", i, i - 1, i > 1 ? "_" : "", i - 1,
                     i > 1 ? "_" : "");
    strcpy(c, "</scene>");
    assert_int_equal(scene_files_load(context, text, &scene), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "attribute 'value' is too long after substitution"));

    /* A chain of includes, and files that include the next one twice. */
    char name[32];
    for (int twice = 0; twice < 2; twice++) {
        for (int i = 0; i < 20; i++) {
            snprintf(name, sizeof name, "chain%d.xml", i);
            c = text + sprintf(text, "<scene version=\"3.0.0\"><include filename=\"chain%d.xml\"/>", i + 1);
            if (twice && i < 13)
                sprintf(c, "<include filename=\"chain%d.xml\"/></scene>", i + 1);
            else
                sprintf(c, "</scene>");
            scene_files_write_text(name, twice && i == 13 ? "<scene version=\"3.0.0\"/>" : text);
        }
        assert_int_equal(brume_scene_load(context, "chain0.xml", NULL, 0, &scene), BRUME_ERROR_SCENE);
        assert_non_null(strstr(brume_context_message(context),
                               twice ? "more than 1000 files are included" : "includes are nested more than 15 deep"));
    }
    assert_null(scene);
    brume_context_destroy(context);
}

/* ---- robustness ------------------------------------------------------------------------------------------------- */

static const char good_file[] =
    "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- everything -->\n"
    "<scene version=\"3.0.0\"><default name=\"spp\" value=\"4\"/>\n"
    "<integrator type=\"volpath\"><integer name=\"max_depth\" value=\"8\"/></integrator>\n"
    "<medium type=\"homogeneous\" id=\"fog\"><rgb name=\"albedo\" value=\"0.9, 0.8 0.7\"/>\n"
    "<spectrum name=\"sigma_t\" value=\"400:0.1, 700:0.3\"/><phase type=\"hg\"><float name=\"g\" "
    "value=\"-.5\"/></phase></medium>\n"
    "<bsdf type=\"twosided\" id=\"wall\"><bsdf type=\"diffuse\"><texture type=\"checkerboard\" name=\"reflectance\">\n"
    "<transform name=\"to_uv\"><scale x=\"2\" y=\"3\"/></transform></texture></bsdf></bsdf>\n"
    "<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"0.1\"/><transform name=\"to_world\">\n"
    "<lookat origin=\"0 0 0\" target=\"0 0 1\" up=\"0 1 0\"/></transform><ref id=\"fog\"/>\n"
    "<film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/><rfilter type=\"mitchell\"/></film>\n"
    "<sampler type=\"multijitter\"><integer name=\"sample_count\" value=\"$spp\"/></sampler></sensor>\n"
    "<emitter type=\"spot\"><spectrum name=\"intensity\" value=\"3\"/><transform name=\"to_world\">\n"
    "<rotate y=\"1\" angle=\"30\"/><translate value=\"1 2 3\"/><matrix value=\"1 0 0 0 1 0 0 0 "
    "1\"/></transform></emitter>\n"
    "<emitter type=\"directional\"><vector name=\"direction\" x=\"1\" y=\"2\" z=\"3\"/></emitter>\n"
    "<shape type=\"sphere\"><point name=\"center\" value=\"1\"/><bsdf type=\"roughconductor\">\n"
    "<string name=\"material\" value=\"Au\"/></bsdf><emitter type=\"area\"><rgb name=\"radiance\" "
    "value=\"1\"/></emitter></shape>\n"
    "<shape type=\"cube\"><ref id=\"wall\"/><ref name=\"interior\" id=\"fog\"/></shape>\n"
    "</scene>\n";

/* Loads it and demands a clean result, whichever. */
static void load_any(brume_context *context, const char *text, size_t length, brume_result *out) {
    brume_scene *scene = NULL;
    scene_files_write("scene.xml", text, length);
    *out = brume_scene_load(context, "scene.xml", NULL, 0, &scene);
    assert_true(*out == BRUME_OK ? scene != NULL : scene == NULL);
    if (*out != BRUME_OK) {
        assert_int_equal(*out, BRUME_ERROR_SCENE);
        /* One line, and the place first. An included file is not named here, so it is always this one. */
        assert_memory_equal(brume_context_message(context), "scene.xml:", 10);
        assert_null(strchr(brume_context_message(context), '\n'));
    }
    brume_scene_destroy(scene);
}

static void test_prefixes(void **state) {
    (void)state;
    brume_context *context;
    brume_result result;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    load_any(context, good_file, sizeof good_file - 1, &result);
    assert_int_equal(result, BRUME_OK);
    for (size_t length = 0; length + 2 < sizeof good_file; length++) {
        load_any(context, good_file, length, &result);
        assert_int_equal(result, BRUME_ERROR_SCENE);
    }
    brume_context_destroy(context);
}

static uint32_t next_random(uint32_t *state) { /* Marsaglia 2003, xorshift */
    *state ^= *state << 13;
    *state ^= *state >> 17;
    return *state ^= *state << 5;
}

static void test_mutations(void **state) {
    (void)state;
    static const char alphabet[] = "<>/\"'=&$;!?-0123456789.eE+:, abcxyz\n\\_";
    brume_context *context;
    brume_result result;
    uint32_t random = 20240607;
    int accepted = 0;
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    for (int i = 0; i < 4000; i++) {
        char text[sizeof good_file];
        size_t length = sizeof good_file - 1;
        memcpy(text, good_file, sizeof good_file);
        for (uint32_t changes = 1 + next_random(&random) % 3; changes; changes--) {
            size_t at = next_random(&random) % length;
            uint32_t how = next_random(&random) % 4;
            if (how == 0)
                text[at] = (char)next_random(&random);
            else if (how == 1)
                memmove(text + at, text + at + 1, length-- - at);
            else
                text[at] = alphabet[next_random(&random) % (sizeof alphabet - 1)];
        }
        load_any(context, text, length, &result);
        accepted += result == BRUME_OK;
    }
    /* Some changes hit numbers or names that mean nothing: if none were accepted, the file wasn't read at all. */
    assert_true(accepted > 10);
    brume_context_destroy(context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bad_files), cmocka_unit_test(test_bad_references_to_files),
        cmocka_unit_test(test_arguments), cmocka_unit_test(test_bombs),
        cmocka_unit_test(test_prefixes),  cmocka_unit_test(test_mutations),
    };
    return cmocka_run_group_tests(tests, scene_files_enter, scene_files_leave);
}
