// SPDX-License-Identifier: Apache-2.0
/// Writes manual pages for man(1) from the tables behind --help.
#ifndef VERGENCE_DAEMON_CLI_MANUAL_H
#define VERGENCE_DAEMON_CLI_MANUAL_H

#include <stdbool.h>
#include <stdio.h>

#include "daemon/cli/options.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Begins a page with its header and the section NAME. `summary` is one line without a full stop.
void manual_begin(FILE *file, const char *name, int section, const char *summary);

/// A section heading, such as "EXIT CODES".
void manual_heading(FILE *file, const char *title);

/// A subheading.
void manual_subheading(FILE *file, const char *title);

/// Paragraphs, separated by one line feed.
void manual_text(FILE *file, const char *text);

/// Paragraphs after a list, outside of it.
void manual_paragraph(FILE *file, const char *text);

/// Lines printed unchanged.
void manual_lines(FILE *file, const char *text);

/// Begins a list entry: `name` in bold, then `value` in italics (NULL: no value). Its text follows.
void manual_entry(FILE *file, const char *name, const char *value);

/// One line of the synopsis: the command in bold, then its operands. `more`: not the first line.
void manual_synopsis(FILE *file, const char *command, const char *operands, bool more);

/// A reference in SEE ALSO to the page `before` + `name`, e.g. "vergence-" and "info".
void manual_reference(FILE *file, const char *before, const char *name, int section, bool last);

/// The page of a command; the caller may add sections.
void manual_options(FILE *file, const struct option_page *page, int section);

#ifdef __cplusplus
}
#endif

#endif
