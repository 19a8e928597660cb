// SPDX-License-Identifier: Apache-2.0
/// What is printed from the tables behind --help: the page for people, the one for man(1), and the
/// words for shell completion.
#ifndef VERGENCE_DAEMON_CLI_HELP_H
#define VERGENCE_DAEMON_CLI_HELP_H

#include <stdbool.h>
#include <stdio.h>

#include "daemon/cli/option_page.h"

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

// ---- manual pages

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

// ---- shell completion: bash statements that fill the array _vergence_words of
// tools/install/completion.bash.in. A key is a command, "vergence info", with the words that may
// follow it; or a command and one of its options or words, "vergence info --size", with its values,
// "" if these are files, numbers or free text.

/// Sets the words of a key, separated by blanks. The key is `key` alone if `part` is NULL.
void shell_completion_print(FILE *file, const char *key, const char *part, const char *words);

/// Adds a word to a key.
void shell_completion_add(FILE *file, const char *key, const char *word);

/// Adds the options of a page and their values.
void shell_completion_options(FILE *file, const struct option_page *page);

#ifdef __cplusplus
}
#endif

#endif
