/* Output files, checked before the first sample: a picture that can't be written should fail in the first second. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli.h"

int cli_output_known(const char *path)
{
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash ? slash : path, '.');
    return dot && (strcasecmp(dot, ".exr") == 0 || strcasecmp(dot, ".png") == 0);
}

int cli_output_check(const char *path)
{
    struct stat status;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        cli_error("%s: is a folder", path);
        return CLI_EXIT_OUTPUT;
    }
    /* Permission bits don't tell for root, read-only or special file systems: only trying does. */
    const char *slash = strrchr(path, '/');
    size_t folder = slash ? (size_t)(slash - path) + 1 : 0;
    static const char probe[] = ".render-cli-XXXXXX";
    char *trial = malloc(folder + sizeof probe);
    if (!trial) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    memcpy(trial, path, folder);
    memcpy(trial + folder, probe, sizeof probe);
    int code = CLI_EXIT_OK;
    int file = mkstemp(trial);
    if (file < 0) {
        cli_error("%s: cannot be written: %s", path, strerror(errno));
        code = CLI_EXIT_OUTPUT;
    } else {
        close(file);
        unlink(trial);
    }
    free(trial);
    return code;
}
