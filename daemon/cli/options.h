// SPDX-License-Identifier: Apache-2.0
/// Command-line options from a table in the grammar of the console (console/command.h): parser,
/// messages, `--help`, manual page and completion use the same entries.
#ifndef VERGENCE_DAEMON_CLI_OPTIONS_H
#define VERGENCE_DAEMON_CLI_OPTIONS_H

#include "daemon/base/message.h"
#include "daemon/cli/option_page.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Parses argv[1..argc-1] into `values` (the struct that `offset` refers to; contains the defaults
/// before the call) and `operands` (room for operands_max). Accepts --help, `--name VALUE`,
/// `--name=VALUE` and `--`; the last of a repeated option counts. For the build, --help-man prints
/// a manual page and --help-words the completions (help.h). Returns OPTIONS_CONTINUE,
/// or the exit code to end with: 0 after --help, 2 after an error, reported on standard error in
/// one line.
int options_parse(const struct option_page *page, int argc, char **argv, void *values,
                  const char **operands, int *operand_count);

/// The same without help and without printing: 0, or ERROR_ARGUMENT with `message` set.
int options_read(const struct option_page *page, int argc, char **argv, void *values,
                 const char **operands, int *operand_count, struct message *message);

/// The first option that is not among `names`, separated by one blank, and whose value is not the
/// default; NULL: none.
const char *options_find_other(const struct option_page *page, const char *names,
                               const void *values, const void *defaults);

/// Bytes of an option's value in the command's own struct.
size_t options_value_bytes(const struct command_argument *option);

/// Exit code of a command that ends with `error`, which is not ERROR_OK: the signal's after
/// ERROR_CANCELLED, CLIENT_FAILED after ERROR_MEMORY, otherwise CLIENT_BAD_INPUT.
int options_exit_code(int error);

/// Replaces the option `old` of earlier versions by the present one, with a note. At most once in a
/// process.
void options_rename(int argc, char **argv, const char *old, const char *now);

#ifdef __cplusplus
}
#endif

#endif
