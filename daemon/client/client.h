// SPDX-License-Identifier: Apache-2.0
/// The frame of the command-line client: commands by name, help, version, exit codes, and a
/// standard output whose errors are noticed. A `main` picks the commands.
#ifndef VERGENCE_DAEMON_CLIENT_CLIENT_H
#define VERGENCE_DAEMON_CLIENT_CLIENT_H

#include <stdbool.h>

#include "daemon/cli/exit_code.h"

#ifdef __cplusplus
extern "C" {
#endif

struct client_command {
    const char *name;
    const char *summary;                // one line, no full stop
    int (*run)(int argc, char **argv);  // argv[0] is the command's name; knows --help itself
};

/// Runs the command that `argv` names and returns the exit code for the process. Standard output
/// is flushed and its errors are reported; a closed pipe ends quietly with 141.
int client_main(int argc, char **argv, const struct client_command *commands, int command_count);

/// A closed standard stream would give its number to the next file opened, and a line printed later
/// would land in that file, or in a device. This takes such numbers by a file that cannot be
/// written to, or not be read as standard input. Called before any other file is opened; false when
/// it cannot.
bool client_occupy_standard_streams(void);

/// The exit code of a program that is about to end with `exit_code`: what standard output did not
/// take is a failure, which a script that reads it must know, and is told in one line. A closed
/// pipe is 141 without a line, where the program ignores SIGPIPE.
int client_finish_output(const char *program, int exit_code);

#ifdef __cplusplus
}
#endif

#endif
