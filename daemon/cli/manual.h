// SPDX-License-Identifier: Apache-2.0
/// Manual pages for man(1), written from the tables behind --help.
#ifndef VERGENCE_DAEMON_CLI_MANUAL_H
#define VERGENCE_DAEMON_CLI_MANUAL_H

#include <stdbool.h>
#include <stdio.h>

#include "daemon/cli/options.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Begins a page: its head and the section NAME. `summary` is one line without a full stop.
void manual_begin(FILE *file, const char *name, int section, const char *summary);

/// A section's heading, such as "EXIT CODES".
void manual_heading(FILE *file, const char *title);

/// One below it.
void manual_subheading(FILE *file, const char *title);

/// Paragraphs (separated by one line feed).
void manual_text(FILE *file, const char *text);

/// The same behind a list, which it is no part of.
void manual_paragraph(FILE *file, const char *text);

/// Lines as they are.
void manual_lines(FILE *file, const char *text);

/// An entry of a list, `name` in bold, `value` (NULL: none) in italics behind it; its text follows.
void manual_entry(FILE *file, const char *name, const char *value);

/// A way to call a command: it in bold, and what stands behind it; one `more`.
void manual_synopsis(FILE *file, const char *command, const char *operands, bool more);

/// A page that the section SEE ALSO names: `before` and `name` together, "vergence-" and "info".
void manual_reference(FILE *file, const char *before, const char *name, int section, bool last);

/// The page of a command; sections of the caller's own may follow.
void manual_options(FILE *file, const struct option_page *page, int section);

#ifdef __cplusplus
}
#endif

#endif
