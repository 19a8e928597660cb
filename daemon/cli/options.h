// SPDX-License-Identifier: Apache-2.0
/// Command-line options from one table: parser, messages and `--help` use the same entries, so they
/// cannot diverge.
#ifndef VERGENCE_DAEMON_CLI_OPTIONS_H
#define VERGENCE_DAEMON_CLI_OPTIONS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum option_kind {
    OPTION_FLAG,    // no value; sets a bool to true
    OPTION_INT,     // `count` integers into int[count]
    OPTION_REAL,    // `count` decimal numbers into double[count]; "inf" when maximum is INFINITY
    OPTION_TEXT,    // a const char * to the argument itself
    OPTION_CHOICE,  // a word of `choices`; its index (0, 1, ...) into an int
};

struct option {
    const char *name;  // without the dashes
    enum option_kind kind;
    size_t offset;            // of the value in the command's struct of values
    const char *value_name;   // as help shows it, e.g. "NEAR:FAR"; NULL for a flag
    const char *help;         // sentences: meaning, unit, default
    double minimum, maximum;  // of every number, inclusive
    int count;                // numbers in one value; 0 means 1
    char separator;           // between them
    const char *choices;      // separated by spaces
};

struct option_page {
    const char *command;  // "vergence reconstruct"
    // As help shows them, e.g. "LEFT RIGHT"; "" for none. If "[OPTIONS]" is among them, options are
    // shown there, else after them.
    const char *operands;
    const char *summary;      // one line, no full stop
    const char *description;  // paragraphs separated by one line feed; wrapped by the printer
    const char *examples;     // lines without indentation; NULL for none
    const struct option *options;
    int option_count;
    int operands_min, operands_max;
};

/// Return value of options_parse if the command should run.
enum { OPTIONS_CONTINUE = -1 };

/// Parses argv[1..argc-1] into `values` (the struct that `offset` refers to; contains the defaults
/// before the call) and `operands` (room for operands_max). Accepts --help, `--name VALUE`,
/// `--name=VALUE` and `--`; the last of a repeated option counts. For the build, --help-man prints
/// a manual page and --help-words the completions (shell_completion.h). Returns OPTIONS_CONTINUE,
/// or the exit code to end with: 0 after --help, 2 after an error, reported on standard error in
/// one line.
int options_parse(const struct option_page *page, int argc, char **argv, void *values,
                  const char **operands, int *operand_count);

/// The word of `candidates` (`count` of them) nearest to `typed` by edit distance, or NULL if none
/// is near. For "did you mean".
const char *options_closest(const char *typed, const char *const *candidates, int count);

#ifdef __cplusplus
}
#endif

#endif
