/* render-cli -- what can be done with a scene file. The commands have files of their own, cli_<command>.c; so have the
 * command line, the progress lines, the checks of output files and the statistics. */
#include "cli.h"

const cli_command_entry cli_commands[CLI_COMMAND_COUNT] = {
    [CLI_RENDER] = {"render", "SCENE.xml", "Renders a Mitsuba 3 scene, with light in fog, on an OpenCL device.",
                    cli_render},
    [CLI_STUDY] = {"study", "SCENE.xml",
                   "Shows what accuracy costs in time: renders a scene with many settings, measures their error,\n"
                   "and writes a page with curves, tables and pictures (study.html), and CSV, JSON, SVG, PNG.",
                   cli_study},
    [CLI_INFO] = {"info", "SCENE.xml",
                  "Says what is in a scene, which effects it calls for and why, and what is built for them.",
                  cli_info},
    [CLI_EFFECTS] = {"effects", "SCENE.xml",
                     "Renders a scene without each of its effects in turn: what each costs and adds.",
                     cli_effects},
    [CLI_MERGE] = {"merge", "FILE...", "Adds up parts of one picture: the checkpoints of renders with --sample-range.",
                   cli_merge},
};

int main(int argc, char **argv)
{
    cli_options options;
    cli_progress progress;
    brume_context *context = NULL;
    int code = cli_options_parse(&options, argc, argv);
    if (code)
        goto cleanup;
    if (options.help || options.version) {
        if (options.help)
            cli_print_help(stdout, options.command);
        else
            puts("render-cli (brume) " BRUME_VERSION);
        goto cleanup;
    }
    cli_watch_signals();
    if (brume_context_create(&context)) {
        cli_error("out of memory");
        code = CLI_EXIT_RUNTIME;
        goto cleanup;
    }
    cli_progress_init(&progress, &options);
    brume_context_set_log(context, cli_progress_log, &progress);
    code = options.list_devices ? cli_list_devices(context)
                                : cli_commands[options.command].run(context, &options, &progress);
cleanup:
    brume_context_destroy(context);
    cli_options_free(&options);
    if (fflush(stdout) != 0 && code == CLI_EXIT_OK)
        code = CLI_EXIT_OUTPUT;
    return code;
}
