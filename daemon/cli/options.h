// SPDX-License-Identifier: Apache-2.0
/// Command lines from one table: the parser, its messages and `--help` derive from the same
/// entries, so that they cannot drift apart.
#ifndef VERGENCE_DAEMON_CLI_OPTIONS_H
#define VERGENCE_DAEMON_CLI_OPTIONS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum option_kind {
    OPTION_FLAG,    // no value; sets a bool to true
    OPTION_INT,     // `count` whole numbers into int[count]
    OPTION_REAL,    // `count` decimal numbers into double[count]; "inf" when maximum is INFINITY
    OPTION_TEXT,    // a const char * to the argument itself
    OPTION_CHOICE,  // a word of `choices`; its place (0, 1, ...) into an int
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
    // As help shows them, e.g. "LEFT RIGHT"; "" for none. With "[OPTIONS]" among them, options are
    // told there alone, else behind them.
    const char *operands;
    const char *summary;      // one line, no full stop
    const char *description;  // paragraphs separated by one line feed; wrapped by the printer
    const char *examples;     // lines without indentation; NULL for none
    const struct option *options;
    int option_count;
    int operands_min, operands_max;
};

/// `options_parse` wants the command to go on.
enum { OPTIONS_CONTINUE = -1 };

/// Parses argv[1..argc-1] into `values` (the struct that `offset` means; holds the defaults before)
/// and `operands` (room for operands_max). Knows --help, `--name VALUE`, `--name=VALUE` and `--`;
/// the last of a repeated option counts. For the build --help-man prints a manual page, and
/// --help-words what a shell may fill in (shell_words.h). Returns OPTIONS_CONTINUE, or the exit
/// code to end with: 0 after --help, 2 after a mistake, which it has reported on standard error in
/// one line.
int options_parse(const struct option_page *page, int argc, char **argv, void *values,
                  const char **operands, int *operand_count);

/// The word of `words` (count of them) closest to `word` by editing distance, or NULL when none is
/// near. For "did you mean".
const char *options_closest(const char *word, const char *const *words, int count);

#ifdef __cplusplus
}
#endif

#endif
