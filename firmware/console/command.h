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

#include "console/command_text.h"
#include "console/command_words.h"

#ifdef __cplusplus
extern "C" {
#endif

struct rig;
struct command;

enum {
    COMMAND_ARGUMENTS_MAX = 40,
    COMMAND_NUMBERS_MAX = 4,
    COMMAND_USAGE_BYTES = 384,  ///< longer than any usage
};

enum command_kind {
    COMMAND_FLAG,     ///< yes or no
    COMMAND_NUMBER,   ///< decimal, in the argument's unit; "inf" if `max` is INFINITY
    COMMAND_INTEGER,  ///< decimal or 0x..., in the argument's unit
    COMMAND_CHOICE,   ///< one of the words in `choices`
    COMMAND_TEXT,     ///< a word, or "quoted words"
};

/// All commands of a console.
struct command_table {
    const struct command *rows;
    size_t count;
};

/// A request for the values that an argument accepts, for completion.
struct command_candidates {
    const char *begun;         ///< the prefix typed so far; other words are ignored
    const char *const *words;  ///< the words before it, from the command's name on
    size_t count;
    const void *context;  ///< the same as in struct command_call
    struct command_table table;
    /// Adds a word, which is copied.
    void (*add)(void *self, const char *word);
    void *self;
};

/// An argument. A name in capitals, as FILE, is an operand: it is given by its position, and
/// optional ones come last. A name in small letters is an option, given by name in any order: the
/// console's `near=500` is the PC's `--near 500`. All strings are static storage.
struct command_argument {
    const char *name;
    enum command_kind kind;
    size_t offset;  ///< position of an option's value in the command's own struct: command_store
    const char *value_name;  ///< an option's value as help shows it, "X,Y,W,H"; NULL: not shown
    const char *help;
    double min, max;  ///< limits of a number; for a text, limits of its length (0, 0: not empty)
    int count;        ///< numbers in one value; 0 means 1
    char separator;   ///< character between the numbers of one value
    const char *choices;  ///< words separated by one blank; of a number, words in place of one;
                          ///< NULL: none
    const char *unit;     ///< NULL: none
    bool optional;        ///< an operand that may be omitted
    /// Adds the values that exist; NULL: they are not known.
    void (*candidates)(const struct command_candidates *to);
    /// Of a number: `unit` and others that it may be in, "counts x mm"; "f/" precedes its number.
    /// min and max are for `unit` only. NULL: `unit`. Any unit of the same kind is accepted, with
    /// or without a blank before (command_words_quantity).
    const char *units;
};

/// An argument's value.
struct command_value {
    bool given;
    union {
        double number;
        double numbers[COMMAND_NUMBERS_MAX];
    };
    int64_t integer;  ///< `number` as an integer
    int choice;       ///< index of the word; of a flag 0 (no) or 1 (yes); -1: a number
    int unit;         ///< index in `units`; 0 is `unit`
    bool stated;      ///< the number was typed with its unit
    const char *text;
};

/// Whether a flag was given as yes.
static inline bool command_is_set(const struct command_value *flag) {
    return flag->given && flag->choice == 1;
}

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
    const struct command_reply *reply;   ///< NULL: the answer is discarded
    char *message;                       ///< one line of text for an error, size below; "": not set
    size_t message_bytes;
    struct command_table table;  ///< that of this command
    void *context;               ///< context of the table's owner: files, sessions, configuration
    void *job;                   ///< the owner's record of this call
    const char *line;            ///< the call as it was entered; NULL: not known
};

/// Add items to the answer: see struct command_reply_operations.
static inline void reply_number(const struct command_call *call, const char *key, double value,
                                int decimals, const char *unit) {
    if (call->reply != NULL) {
        call->reply->operations->number(call->reply->self, key, value, decimals, unit);
    }
}
static inline void reply_text(const struct command_call *call, const char *key, const char *value) {
    if (call->reply != NULL) {
        call->reply->operations->text(call->reply->self, key, value);
    }
}
static inline void reply_group_begin(const struct command_call *call, const char *key, bool array) {
    if (call->reply != NULL) {
        call->reply->operations->begin(call->reply->self, key, array);
    }
}
static inline void reply_group_end(const struct command_call *call) {
    if (call->reply != NULL) {
        call->reply->operations->end(call->reply->self);
    }
}

enum {
    COMMAND_NEEDS_RIG = 1,  ///< refused unless the rig is RIG_READY
    COMMAND_LONG = 2,       ///< reports progress and can be cancelled
    COMMAND_MOVES = 4,      ///< moves or writes something
    COMMAND_NO_RIG = 8,     ///< does not touch the rig: may run in parallel with another command
    /// Touches the rig through other commands only, or never while it is recorded, so recordings
    /// leave it out.
    COMMAND_UNRECORDED = 16,
    COMMAND_DAILY = 32,  ///< help lists it among the first commands
    // The groups of help.
    COMMAND_GROUP_SERVICE = 0,
    COMMAND_GROUP_LOOK = 1 << 8,
    COMMAND_GROUP_MOVE = 2 << 8,
    COMMAND_GROUP_LIGHT = 3 << 8,
    COMMAND_GROUP_MEASURE = 4 << 8,
    COMMAND_GROUP_FILES = 5 << 8,
    COMMAND_GROUPS = 7 << 8,
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
/// quotes may contain blanks, \" and \\, and is never an option; so may the value in name="value".
/// A # at the beginning of a word ends the line. Of an option given twice the last counts.
///
/// Returns 0, or an error with one line in `message` that says what is wrong and what is expected:
/// ERROR_SYNTAX (malformed line or number), ERROR_RANGE, ERROR_MISSING (an argument),
/// ERROR_ARGUMENT (unknown command, option or choice, or too many operands). The other outputs are
/// undefined after an error. `storage` (COMMAND_LINE_MAX + 1 bytes) holds the texts of the values;
/// `values` has room for COMMAND_ARGUMENTS_MAX. An empty line or a comment returns 0 with `*found`
/// NULL.
int command_parse(const char *line, const struct command *table, size_t count, char *storage,
                  struct command_value *values, const struct command **found, char *message,
                  size_t message_bytes);

/// Arguments that are being parsed, and how options are written.
struct command_parser {
    const char *command;  ///< its name, for messages
    const struct command_argument *arguments;
    unsigned count;
    const char *dashes;  ///< how messages write options: "--near", or "": near=VALUE
    struct command_text *message;
};

/// Whether the word is an option: "--name" always, "name=value" at the console.
bool command_is_option(const struct command_parser *parser, const char *word);

/// Parses the option at words[*at]: "name=value", "--name=value", "--name value", or "--name" of a
/// flag. Leaves `*at` on the last word used, and the value in `values`. Errors of command_parse.
int command_parse_option(const struct command_parser *parser, const char *const *words,
                         size_t word_count, size_t *at, struct command_value *values);

/// Copies the given values into a struct, at each argument's `offset`: an int or double for each
/// number, an int for a choice, a bool for a flag, a const char * for a text.
void command_store(const struct command_argument *arguments, unsigned count,
                   const struct command_value *values, void *into);

/// Whether an argument is an option.
bool command_argument_is_option(const struct command_argument *argument);

/// The words of a choice or a flag, separated by one blank.
const char *command_choices(const struct command_argument *argument);

/// Writes the limits of a value: "a number from 1 to 1000 us", "left, right or both".
void command_expected(const struct command_argument *argument, struct command_text *text);

/// Runs a command that command_parse has found. Returns ERROR_NOT_READY if the command needs the
/// rig and the rig is not RIG_READY. Every error comes with a message.
int command_run(const struct command *command, const struct command_call *call);

/// Sets the message of a call as command_text_message does. Returns `error`.
__attribute__((format(printf, 3, 4))) int command_refuse(const struct command_call *call, int error,
                                                         const char *format, ...);

/// Writes the usage: the name and the arguments, optional ones in brackets, options as
/// [name=VALUE]. Truncated if longer than `bytes` (> 0).
void command_usage(const struct command *command, char *text, size_t bytes);

/// Returns the command of that name, or NULL.
const struct command *command_find(const struct command *table, size_t count, const char *name);

/// Writes `unknown command "NAME" (did you mean "..."?)`; returns ERROR_ARGUMENT.
int command_unknown(const struct command *table, size_t count, const char *name,
                    struct command_text *message);

/// Joins what these functions return into `all`, which has room for `capacity` commands.
struct command_table command_join(const struct command *(*const tables[])(size_t *),
                                  size_t table_count, struct command *all, size_t capacity);

/// The rig's own commands: those that need only the rig.
const struct command *command_rig_table(size_t *count);

#ifdef __cplusplus
}
#endif

#endif
