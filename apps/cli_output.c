/* Output files, checked before the first sample: a picture that can't be written should fail in the first second. */
#include <errno.h>
#include <string.h>

#include "cli.h"
#include "platform.h"

int cli_output_known(const char *path)
{
    const char *dot = strrchr(path + brume_path_folder(path), '.');
    return dot && (brume_same_letters(dot, ".exr") || brume_same_letters(dot, ".png"));
}

int cli_output_check(const char *path)
{
    if (brume_path_is_folder(path)) {
        cli_error("%s: is a folder", path);
        return CLI_EXIT_OUTPUT;
    }
    int error = platform_probe(path);
    if (!error)
        return CLI_EXIT_OK;
    if (error == ENOMEM) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    cli_error("%s: cannot be written: %s", path, strerror(error));
    return CLI_EXIT_OUTPUT;
}

int cli_outputs_check(const cli_options *options)
{
    for (size_t i = 0; i < options->output_count; i++) {
        int code = cli_output_check(options->outputs[i]);
        if (code)
            return code;
    }
    return options->stats_path && *options->stats_path ? cli_output_check(options->stats_path) : CLI_EXIT_OK;
}
