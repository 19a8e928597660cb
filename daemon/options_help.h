// SPDX-License-Identifier: Apache-2.0
/// The page that --help prints, derived from the table of options.
#ifndef VERGENCE_DAEMON_OPTIONS_HELP_H
#define VERGENCE_DAEMON_OPTIONS_HELP_H

#include <stdio.h>

#include "daemon/options.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Prints the whole page.
void options_help_print(const struct option_page *page, FILE *file);

/// Prints paragraphs (separated by one line feed) wrapped to 80 columns, each line indented by
/// `indent` spaces.
void options_help_print_wrapped(FILE *file, int indent, const char *text);

#ifdef __cplusplus
}
#endif

#endif
