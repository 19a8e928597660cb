// SPDX-License-Identifier: Apache-2.0
/// Commands: a name, arguments with ranges and units, help, and who carries it out. One table
/// serves people at a console, programs on a socket, scripts and tests.
///
/// A command's answer is a list of items (key, value, unit) and ends in OK or `ERR code text`. It
/// is written through `struct command_reply`, so whoever asked gets it as text or as JSON.
#ifndef VERGENCE_CONSOLE_COMMAND_H
#define VERGENCE_CONSOLE_COMMAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct rig;

enum {
    COMMAND_LINE_MAX = 512,  ///< longest line, without its end
    COMMAND_ARGUMENTS_MAX = 8,
};

enum command_kind {
    COMMAND_NUMBER,   ///< decimal, in the argument's unit
    COMMAND_INTEGER,  ///< decimal or 0x..., in the argument's unit
    COMMAND_CHOICE,   ///< one of the words in `choices`
    COMMAND_TEXT,     ///< a word, or "words in quotes"
};

/// Who asks what may stand in an argument's place, to fill it in.
struct command_candidates {
    const char *begun;         ///< what was typed of it; words that begin otherwise are of no use
    const char *const *words;  ///< those before it, the command's name first
    size_t count;
    const void *surroundings;  ///< as those of a call
    /// Takes a word, which is copied.
    void (*add)(void *self, const char *word);
    void *self;
};

/// An argument. All strings are static storage.
struct command_argument {
    const char *name;
    enum command_kind kind;
    const char *unit;     ///< NULL: none
    double least, most;   ///< of a number; of a text its length
    const char *choices;  ///< words with a blank between; NULL: none
    bool optional;        ///< only after all that are not
    const char *help;
    /// Adds what there is of a text that names something; NULL: nobody knows.
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

/// One call.
struct command_call {
    struct rig *rig;
    const struct command_value *values;  ///< one for each argument of the command
    const struct command_reply *reply;
    char *message;  ///< one line for people in case of an error, of the size below; "": none yet
    size_t message_bytes;
    /// What whoever runs the table has to add to its state, once axes were read; its error is that
    /// of the command that asked. NULL: nothing.
    int (*put_state)(const struct command_call *call);
    void *surroundings;  ///< of whoever runs the table: files, sessions, configuration
};

enum {
    COMMAND_NEEDS_RIG = 1,  ///< refused until `bringup` has worked
    COMMAND_LONG = 2,       ///< tells progress, and can be cancelled
    COMMAND_MOVES = 4,      ///< moves or writes something
    COMMAND_NO_RIG = 8,     ///< touches nothing of the rig: may run while another command does
    /// Touches the rig by other commands alone, or not while it is recorded: a recording of what
    /// was done with the rig has no need of it.
    COMMAND_UNRECORDED = 16,
};

struct command {
    const char *name;
    const char *summary;  ///< one line, no full stop
    const char *help;     ///< paragraphs
    const struct command_argument *arguments;
    unsigned argument_count;
    unsigned flags;
    /// 0 or an error of core/error.h.
    int (*run)(const struct command_call *call);
};

/// Takes a line apart and checks it against the table. Words are separated by blanks; a word in
/// double quotes may hold blanks, and \" and \\ there; a # that begins a word ends the line. A
/// choice that is optional may be left out in front of a number, too, a text that is optional in
/// front of a choice that ends the line, and whatever is optional, but a text, in front of a
/// choice.
///
/// Returns 0, or with a sentence in `message` that says what is wrong and what would be right:
/// ERROR_SYNTAX (the line cannot be taken apart, or a number is none), ERROR_RANGE, ERROR_MISSING
/// (an argument), ERROR_ARGUMENT (no such command or choice, or too many arguments). The other
/// outputs are undefined then. `storage` (COMMAND_LINE_MAX + 1 bytes) holds the texts of the
/// values, `values` has room for COMMAND_ARGUMENTS_MAX. An empty line or a comment is 0 with
/// `*found` NULL.
int command_parse(const char *line, const struct command *table, size_t count, char *storage,
                  struct command_value *values, const struct command **found, char *message,
                  size_t message_bytes);

/// Runs a command that command_parse has found. Refuses with ERROR_NOT_READY what needs the rig
/// while it is not RIG_READY. Whatever is not 0 comes with a message.
int command_run(const struct command *command, const struct command_call *call);

/// How a command is called: its name and its arguments, those in brackets that may be left out.
/// Cut off when it is longer than `bytes` (> 0).
void command_usage(const struct command *command, char *text, size_t bytes);

/// The command of that name, or NULL; and the nearest name, NULL when none is near.
const struct command *command_find(const struct command *table, size_t count, const char *name);
const char *command_nearest(const struct command *table, size_t count, const char *name);

/// The instrument's own commands: those that need nothing but the rig.
const struct command *command_rig_table(size_t *count);

#ifdef __cplusplus
}
#endif

#endif
