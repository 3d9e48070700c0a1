/* test_cli_debug.c -- from render-cli's warning of a bad sample to what its path did: the command that the warning
 * names is given to a shell. */
#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "planted.h"
#include "render_cli.h"

static const char name[] = "it's fog.xml"; /* a name that a shell would take apart */
static const char scene[] =
    "<scene version='3.0.0'>\n"
    "<default name='width' value='24'/>\n"
    "<integrator type='volpath'><integer name='max_depth' value='4'/></integrator>\n"
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.2'/></medium>\n"
    "<sensor type='perspective'><ref id='fog'/>\n"
    "<film type='hdrfilm'><integer name='width' value='$width'/><integer name='height' value='12'/></film></sensor>\n"
    "<emitter type='point'><point name='position' x='1' y='2' z='5'/></emitter>\n"
    "<shape type='rectangle'><transform name='to_world'><scale value='30'/><translate z='8'/></transform>\n"
    "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>\n"
    "</scene>\n";

static void the_warning_s_command_explains_the_sample(void **state) {
    (void)state;
    if (!cli_has_device()) skip();

    const char *const render[] = {cli_program, name, "-o", "a.exr", "-Dwidth=20", "--seed", "5", "--spp", "8",
                                  "--crop", "2,12,1,9", "--without", "anisotropy", "-v", NULL};
    assert_true(child_run(&cli, cli_folder, render, NULL, 0));
    assert_int_equal(cli.status, 0);
    assert_null(strstr(cli.err, "warning"));
    planted_bug("path_state.h", "    p.radiance = cgrey(R(0));",
                "    p.radiance = cgrey(((x == I(5)) & (y == I(3)) & (to_ireal(sample) == I(6))) ? REAL_NAN : R(0));");
    assert_true(child_run(&cli, cli_folder, render, NULL, 0));
    assert_int_equal(cli.status, 0);
    assert_non_null(strstr(cli.err, "warning: 1 samples came out NaN or infinite"));
    const char *shown = strstr(cli.err, "is shown by: ");
    assert_non_null(shown);

    char command[4 * PATH_MAX];
    snprintf(command, sizeof command, "%.*s", (int)strcspn(shown, "\n") - 13, shown + 13);
    assert_non_null(strstr(command, "--debug-sample=5,3,6"));
    assert_null(strstr(command, "spp"));
    const char *const replay[] = {"/bin/sh", "-c", command, NULL};
    assert_true(child_run(&cli, cli_folder, replay, NULL, 0));
    planted_remove();
    assert_int_equal(cli.status, 0);
    assert_string_equal(cli.err, "");
    assert_ptr_equal(strstr(cli.out, "sample 6 of pixel 5, 3, in float\n"), cli.out);
    assert_non_null(strstr(cli.out, "   <- here\n"));
    assert_non_null(strstr(cli.out, "radiance: not finite; a picture drops this sample\n"));

    /* Without the planted error nothing is wrong with it. */
    assert_true(child_run(&cli, cli_folder, replay, NULL, 0));
    assert_int_equal(cli.status, 0);
    assert_null(strstr(cli.out, "<- here"));
    assert_non_null(strstr(cli.out, "radiance, as the film gets it: ("));

    snprintf(command, sizeof command, "%s \"%s\" --debug-sample 24,0,0", cli_program, name);
    assert_true(child_run(&cli, cli_folder, replay, NULL, 0));
    assert_int_equal(cli.status, 2);
    cli_expect_error_line("outside the film of 24 x 12");
}

static int setup(void **state) {
    (void)state;
    if (cli_open(NULL) != 0) return 1;
    cli_write(name, scene);
    return 0;
}

static int teardown(void **state) {
    static const char *const files[] = {name, "a.exr"};
    (void)state;
    planted_remove();
    return cli_close(files, 2); /* a sample explained leaves no picture */
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_warning_s_command_explains_the_sample)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
