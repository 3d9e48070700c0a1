/* render_cli.c -- render-cli as a child, and its files. */
#include "render_cli.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "json_text.h"

char cli_program[2 * PATH_MAX], cli_folder[512];
child_result cli;

const char cli_scene[] =
    "<scene version='3.0.0'>\n"
    "<default name='width' value='24'/><default name='spp' value='2'/>\n"
    "<integrator type='volpath'/>\n"
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.2'/></medium>\n"
    "<sensor type='perspective'>\n"
    "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/></transform><ref id='fog'/>\n"
    "<sampler type='independent'><integer name='sample_count' value='$spp'/></sampler>\n"
    "<film type='hdrfilm'><integer name='width' value='$width'/><integer name='height' value='16'/></film></sensor>\n"
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/></transform>\n"
    "<rgb name='intensity' value='60'/></emitter>\n"
    "<shape type='sphere'><point name='center' x='0' y='1' z='0'/></shape>\n"
    "</scene>\n";

int cli_find(void) {
    const char *build = getenv("BRUME_BUILD") ? getenv("BRUME_BUILD") : "build";
    char here[PATH_MAX];
    if (!getcwd(here, sizeof here)) return -1;
    /* absolute, because children run elsewhere */
    const char *parent = build[0] == '/' ? "" : here, *slash = build[0] == '/' ? "" : "/";
    int length = snprintf(cli_program, sizeof cli_program, "%s%s%s/render-cli", parent, slash, build);
    return length < (int)sizeof cli_program ? access(cli_program, X_OK) : -1;
}

int cli_open(const char *scene) {
    snprintf(cli_folder, sizeof cli_folder, "/tmp/test-cli-XXXXXX");
    if (cli_find() != 0 || !mkdtemp(cli_folder)) return -1;
    if (scene) cli_write("scene.xml", scene);
    return 0;
}

int cli_close(const char *const *files, size_t count) {
    for (size_t i = 0; i < count; i++) cli_remove(files[i]);
    return rmdir(cli_folder);
}

int cli_run_until(const char *line, const char *signal_after, int number) {
    const char *const first[] = {cli_program, NULL};
    return child_run_line(&cli, cli_folder, first, line, signal_after, number);
}

int cli_run(const char *line) { return cli_run_until(line, NULL, 0); }

int cli_has_device(void) { return cli_run("--list-devices") == 0; }

void cli_expect_error_line(const char *part) {
    static const char prefix[] = "render-cli: error: ";
    if (strncmp(cli.err, prefix, sizeof prefix - 1) != 0 || !strstr(cli.err, part) ||
        strchr(cli.err, '\n') != cli.err + strlen(cli.err) - 1)
        fail_msg("expected one error line with \"%s\", got:\n%s", part, cli.err);
}

void cli_expect_member(const char *name, const char *value) {
    const char *found = json_member(cli.out, name);
    if (!found || strncmp(found, value, strlen(value)) != 0 || !strchr(",}\n", found[strlen(value)]))
        fail_msg("expected \"%s\":%s in %s", name, value, cli.out);
}

void cli_path(char out[PATH_MAX], const char *name) { snprintf(out, PATH_MAX, "%s/%s", cli_folder, name); }

void cli_write(const char *name, const char *text) {
    char path[PATH_MAX];
    cli_path(path, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

long cli_read(const char *name, char *bytes, size_t room) {
    char path[PATH_MAX];
    cli_path(path, name);
    FILE *file = fopen(path, "rb");
    if (!file) return -1;
    size_t count = fread(bytes, 1, room, file);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    fclose(file);
    if (count < room) bytes[count] = 0;
    return size;
}

void cli_remove(const char *name) {
    char path[PATH_MAX];
    cli_path(path, name);
    unlink(path);
}
