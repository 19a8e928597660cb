// SPDX-License-Identifier: Apache-2.0
/// The page that --help prints, from the table of options.
#ifndef VERGENCE_DAEMON_CLI_OPTIONS_HELP_H
#define VERGENCE_DAEMON_CLI_OPTIONS_HELP_H

#include <stdio.h>

#include "daemon/cli/options.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { OPTIONS_HELP_TEXT_BYTES = 512 };  ///< longer than any usage line or limit text

/// Prints the whole page.
void options_help_print(const struct option_page *page, FILE *file);

/// Prints paragraphs (separated by one line feed), wrapped to 80 columns and indented by `indent`
/// spaces.
void options_help_print_wrapped(FILE *file, int indent, const char *text);

/// The usage line of a command, "vergence reconstruct LEFT RIGHT [OPTIONS]"; and the limits of an
/// option's values, "(an integer from 1 to 64)", or "" if there are none. `text` has
/// OPTIONS_HELP_TEXT_BYTES.
void options_help_usage(const struct option_page *page, char *text, size_t bytes);
void options_help_limits(const struct command_argument *option, char *text, size_t bytes);

#ifdef __cplusplus
}
#endif

#endif
