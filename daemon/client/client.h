// SPDX-License-Identifier: Apache-2.0
/// Frame of the command-line client: commands by name, help, version, exit codes, and a check for
/// write errors on standard output. Each `main` chooses its commands.
#ifndef VERGENCE_DAEMON_CLIENT_CLIENT_H
#define VERGENCE_DAEMON_CLIENT_CLIENT_H

#include <stdbool.h>

#include "daemon/cli/options.h"

#ifdef __cplusplus
extern "C" {
#endif

struct client_command {
    const char *name;
    const char *summary;                // one line, no full stop
    int (*run)(int argc, char **argv);  // argv[0] is the command's name; handles --help itself
    // Checks a command line as `run` does, and does nothing else: OPTIONS_CONTINUE, or the exit
    // code, with one line on standard error. NULL: `run` alone finds out.
    int (*check)(int argc, char **argv);
};

/// Runs the command that `argv` names and returns the exit code for the process. Standard output
/// is flushed and its errors are reported; a closed pipe ends quietly with 141.
int client_main(int argc, char **argv, const struct client_command *commands, int command_count);

/// Closed standard streams are opened on a file that can be neither written nor, as standard input,
/// read. Otherwise the next file opened would get their number, and a later line of output would go
/// into that file or device. Call this before any other file is opened; false on failure.
bool client_occupy_standard_streams(void);

/// Final exit code of a program that would end with `exit_code`: if standard output did not accept
/// everything, the program has failed and prints one line. A closed pipe gives 141 without a line,
/// if the program ignores SIGPIPE.
int client_finish_output(const char *program, int exit_code);

#ifdef __cplusplus
}
#endif

#endif
