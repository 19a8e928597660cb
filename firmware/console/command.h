// SPDX-License-Identifier: Apache-2.0
/// Commands: name, arguments with ranges and units, help, and the function that runs it. One table
/// serves the console, programs on a socket, scripts and tests.
///
/// A reply is a list of items (key, value, unit) and ends in OK or `ERR code text`. It is written
/// through `struct command_reply`, so the client gets text or JSON.
#ifndef VERGENCE_CONSOLE_COMMAND_H
#define VERGENCE_CONSOLE_COMMAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "console/command_words.h"

#ifdef __cplusplus
extern "C" {
#endif

struct rig;

enum {
    COMMAND_ARGUMENTS_MAX = 8,
};

enum command_kind {
    COMMAND_NUMBER,   ///< decimal, in the argument's unit
    COMMAND_INTEGER,  ///< decimal or 0x..., in the argument's unit
    COMMAND_CHOICE,   ///< one of the words in `choices`
    COMMAND_TEXT,     ///< a word, or "quoted words"
};

/// A request for the values that an argument accepts, for completion.
struct command_candidates {
    const char *begun;         ///< the prefix typed so far; other words are ignored
    const char *const *words;  ///< the words before it, from the command's name on
    size_t count;
    const void *context;  ///< as in struct command_call
    /// Adds a word, which is copied.
    void (*add)(void *self, const char *word);
    void *self;
};

/// An argument. All strings are static storage.
struct command_argument {
    const char *name;
    enum command_kind kind;
    const char *unit;     ///< NULL: none
    double min, max;      ///< of a number; for a text, limits of its length
    const char *choices;  ///< words separated by one blank; NULL: none
    bool optional;        ///< optional arguments come last
    const char *help;
    /// Adds the values that exist; NULL: they are not known.
    void (*candidates)(const struct command_candidates *to);
};

/// An argument's value.
struct command_value {
    bool given;
    double number;
    int64_t integer;
    int choice;  ///< index of the word
    const char *text;
};

/// Where the answer goes. Strings are copied or sent before a function returns.
struct command_reply_operations {
    /// A value; `decimals` after the point. `unit` NULL: none.
    void (*number)(void *self, const char *key, double value, int decimals, const char *unit);
    void (*text)(void *self, const char *key, const char *value);
    /// Items up to the matching end belong together: a JSON object, or an array of what follows.
    void (*begin)(void *self, const char *key, bool array);
    void (*end)(void *self);
};

struct command_reply {
    const struct command_reply_operations *operations;
    void *self;
};

/// One call of a command.
struct command_call {
    struct rig *rig;
    const struct command_value *values;  ///< one for each argument of the command
    const struct command_reply *reply;
    char *message;  ///< one line of text for an error, size below; "": not set
    size_t message_bytes;
    void *context;  ///< context of the table's owner: files, sessions, configuration
    void *job;      ///< the owner's record of this call
};

enum {
    COMMAND_NEEDS_RIG = 1,  ///< refused unless the rig is RIG_READY
    COMMAND_LONG = 2,       ///< reports progress and can be cancelled
    COMMAND_MOVES = 4,      ///< moves or writes something
    COMMAND_NO_RIG = 8,     ///< does not touch the rig: may run in parallel with another command
    /// Touches the rig through other commands only, or never while it is recorded, so recordings
    /// leave it out.
    COMMAND_UNRECORDED = 16,
};

struct command {
    const char *name;
    const char *summary;  ///< one line, no full stop
    const char *help;     ///< paragraphs of text
    const struct command_argument *arguments;
    unsigned argument_count;
    unsigned flags;
    /// Returns 0 or an error of core/error.h.
    int (*run)(const struct command_call *call);
};

/// Parses a line and checks it against the table. Words are separated by blanks. A word in double
/// quotes may contain blanks, \" and \\. A # at the beginning of a word ends the line. Optional
/// arguments may be left out: a choice before a number, a text before a choice that ends the line,
/// and anything but a text before a choice.
///
/// Returns 0, or an error with one line in `message` that says what is wrong and what is expected:
/// ERROR_SYNTAX (malformed line or number), ERROR_RANGE, ERROR_MISSING (an argument),
/// ERROR_ARGUMENT (unknown command or choice, or too many arguments). The other outputs are
/// undefined after an error. `storage` (COMMAND_LINE_MAX + 1 bytes) holds the texts of the values;
/// `values` has room for COMMAND_ARGUMENTS_MAX. An empty line or a comment returns 0 with `*found`
/// NULL.
int command_parse(const char *line, const struct command *table, size_t count, char *storage,
                  struct command_value *values, const struct command **found, char *message,
                  size_t message_bytes);

/// Runs a command that command_parse has found. Returns ERROR_NOT_READY if the command needs the
/// rig and the rig is not RIG_READY. Every error comes with a message.
int command_run(const struct command *command, const struct command_call *call);

/// Writes the usage: the name and the arguments, optional ones in brackets. Truncated if longer
/// than `bytes` (> 0).
void command_usage(const struct command *command, char *text, size_t bytes);

/// Returns the command of that name, or NULL; and the most similar name, or NULL if none is close.
const struct command *command_find(const struct command *table, size_t count, const char *name);
const char *command_nearest(const struct command *table, size_t count, const char *name);

/// The rig's own commands: those that need only the rig.
const struct command *command_rig_table(size_t *count);

#ifdef __cplusplus
}
#endif

#endif
