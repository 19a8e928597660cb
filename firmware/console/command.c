// SPDX-License-Identifier: Apache-2.0
#include "console/command.h"

#include <math.h>
#include <string.h>

#include "console/synonyms.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/suggest.h"

enum { QUANTITY_BYTES = 64 };

const struct command *command_find(const struct command *table, size_t count, const char *name) {
    for (size_t i = 0; i < count; i++) {
        if (strcmp(table[i].name, name) == 0) {
            return &table[i];
        }
    }
    return NULL;
}

int command_unknown(const struct command *table, size_t count, const char *name,
                    struct command_text *message) {
    const char *meant = synonyms_command(name, NULL);
    struct suggest suggest;
    suggest_begin(&suggest, name, "");
    for (size_t i = 0; i < count; i++) {
        suggest_consider(&suggest, table[i].name);
    }
    command_text_add(message, "unknown command \"");
    command_text_add_typed(message, name);
    command_text_add(message, "\"");
    if (meant != NULL && command_find(table, count, meant) != NULL) {
        command_text_join(message, " (did you mean \"", meant, "\"?)");
        return ERROR_ARGUMENT;
    }
    command_text_add(message,
                     suggest.text[0] != '\0' ? suggest.text : " (\"help\" lists all commands)");
    return ERROR_ARGUMENT;
}

bool command_argument_is_option(const struct command_argument *argument) {
    return argument->name[0] >= 'a' && argument->name[0] <= 'z';
}

/// Begins a message about the command.
static struct command_text *begin(const struct command_parser *parser) {
    command_text_join(parser->message, parser->command, ": ");
    return parser->message;
}

static void add_name(const struct command_parser *parser, const struct command_argument *argument) {
    command_text_join(parser->message, command_argument_is_option(argument) ? parser->dashes : "",
                      argument->name);
}

static void add_quoted(struct command_text *message, const char *word) {
    command_text_add(message, "\"");
    command_text_add_typed(message, word);
    command_text_add(message, "\"");
}

/// Writes `pan: ANGLE "x" is not a number (expected ...)`. `word` NULL: there is none.
static int refuse(const struct command_parser *parser, const struct command_argument *argument,
                  int error, const char *word, const char *what) {
    struct command_text *message = begin(parser);
    INVARIANT(error < 0);
    add_name(parser, argument);
    if (word != NULL) {
        command_text_add(message, " ");
        add_quoted(message, word);
    }
    command_text_join(message, what, " (expected ");
    command_expected(argument, message);
    command_text_add(message, ")");
    return error;
}

/// The units that a number may be in; the first is that of its limits. NULL: none.
static const char *units_of(const struct command_argument *argument) {
    return argument->units != NULL ? argument->units : argument->unit;
}

static bool is_number(const struct command_argument *argument) {
    return argument->kind == COMMAND_NUMBER || argument->kind == COMMAND_INTEGER;
}

/// What is wrong with a text that should be a number.
static const char *not_one(const struct command_argument *argument) {
    if (argument->count > 1) {
        return " is invalid";
    }
    return argument->kind == COMMAND_INTEGER ? " is not an integer" : " is not a number";
}

/// Rounds to an integer. False: the number had to be one.
static bool round_number(const struct command_argument *argument, struct command_number *number,
                         int64_t *integer) {
    const bool fits = number->value > -1e15 && number->value < 1e15;
    *integer = fits ? (int64_t)(number->value + (number->value < 0 ? -0.5 : 0.5)) : 0;
    if (number->unit != 0 || !fits || (double)*integer == number->value) {
        return true;
    }
    number->value = (double)*integer;
    // A position is reported with decimals, and a time in another unit is rarely a whole number.
    return number->converted || argument->units != NULL;
}

/// Reads a number from `text`, which has no other characters. 0, or ERROR_SYNTAX with `*what`.
static int read_number(const struct command_argument *argument, const char *text,
                       struct command_number *number, int64_t *integer, const char **what) {
    const bool whole = argument->kind == COMMAND_INTEGER;
    *number = (struct command_number){.unit = 0};
    *integer = 0;
    if (whole && command_words_integer(text, integer)) {
        number->value = (double)*integer;
        return ERROR_OK;
    }
    if (isinf(argument->max) && (strcmp(text, "inf") == 0 || strcmp(text, "infinity") == 0)) {
        number->value = INFINITY;
        return ERROR_OK;
    }
    const enum command_quantity read = command_words_quantity(text, units_of(argument), number);
    if (read == COMMAND_QUANTITY_READ && (!whole || round_number(argument, number, integer))) {
        return ERROR_OK;
    }
    *what = read == COMMAND_QUANTITY_UNKNOWN_UNIT ? " has an unknown unit" : not_one(argument);
    return ERROR_SYNTAX;
}

/// Takes the number at `at`, which ends at `end`; NULL: it does not end where it should. `unit`
/// follows a number that has none.
static int take_number(const struct command_parser *parser, const struct command_argument *argument,
                       const char *word, const char *at, const char *end, const char *unit,
                       struct command_number *number, int64_t *integer) {
    char text[QUANTITY_BYTES];
    const size_t length = end != NULL ? (size_t)(end - at) : sizeof text;
    const char *what = not_one(argument);
    int error = ERROR_SYNTAX;
    if (length + strlen(unit) < sizeof text) {
        const bool bare = length > 0 && at[length - 1] >= '0' && at[length - 1] <= '9';
        memcpy(text, at, length);
        strcpy(text + length, bare ? unit : "");
        error = read_number(argument, text, number, integer, &what);
    }
    if (error != ERROR_OK) {
        return refuse(parser, argument, error, word, what);
    }
    const bool own = number->unit == 0;
    if (own ? number->value < argument->min : number->value <= 0) {
        return refuse(parser, argument, ERROR_RANGE, word, " is too small");
    }
    return own && number->value > argument->max
               ? refuse(parser, argument, ERROR_RANGE, word, " is too large")
               : ERROR_OK;
}

/// The unit at the end of several numbers, "m" of "1.75:1.85m", which is that of all; "": none.
static const char *common_unit(const struct command_argument *argument, const char *word) {
    const char *last = strrchr(word, argument->separator);
    const char *unit = last != NULL ? last + 1 : word;
    double ratio = 0;
    unit += strspn(unit, "+-./0123456789");
    return command_words_unit(unit, units_of(argument), &ratio) >= 0 && strlen(unit) < 8 ? unit
                                                                                         : "";
}

/// Takes the numbers of a word; `unit` is what follows it.
static int take_numbers(const struct command_parser *parser,
                        const struct command_argument *argument, const char *word, const char *unit,
                        struct command_value *value) {
    const int count = argument->count > 0 ? argument->count : 1;
    const char *at = word;
    INVARIANT(count <= COMMAND_NUMBERS_MAX);
    unit = count > 1 && *unit == '\0' ? common_unit(argument, word) : unit;
    for (int i = 0; i < count; i++) {
        const bool last = i + 1 == count;
        struct command_number number;
        int64_t integer = 0;
        const char *end = last ? at + strlen(at) : strchr(at, argument->separator);
        end = end == NULL && argument->separator == 'x' ? strchr(at, 'X') : end;  // 9X6
        const int error = take_number(parser, argument, word, at, end, unit, &number, &integer);
        if (error != ERROR_OK) {
            return error;
        }
        at = last ? end : end + 1;
        value->numbers[i] = number.value;
        value->integer = i == 0 ? integer : value->integer;
        value->unit = number.unit;
        value->stated = value->stated || number.stated;
    }
    return ERROR_OK;
}

static int take_choice(const struct command_parser *parser, const struct command_argument *argument,
                       const char *word, struct command_value *value) {
    struct command_text *message = parser->message;
    struct suggest suggest;
    value->choice = command_words_choice(word, command_choices(argument));
    if (value->choice >= 0) {
        return ERROR_OK;
    }
    suggest_begin(&suggest, word, "");
    suggest_consider_all(&suggest, command_choices(argument));
    begin(parser);
    command_text_add(message, "unknown ");
    add_name(parser, argument);
    command_text_add(message, " ");
    add_quoted(message, word);
    command_text_join(message, suggest.text,
                      suggest.text[0] != '\0' ? "; expected " : " (expected ");
    command_expected(argument, message);
    command_text_add(message, suggest.text[0] != '\0' ? "" : ")");
    return ERROR_ARGUMENT;
}

/// `unit`: the word after it, if that is a unit of the argument; "": none.
static int take_value(const struct command_parser *parser, const struct command_argument *argument,
                      const char *word, const char *unit, struct command_value *value) {
    *value = (struct command_value){.given = true, .choice = -1, .text = word};
    switch (argument->kind) {
        case COMMAND_NUMBER:
        case COMMAND_INTEGER:
            if (*unit == '\0' && argument->choices != NULL) {
                value->choice = command_words_choice(word, argument->choices);
            }
            return value->choice >= 0 ? ERROR_OK
                                      : take_numbers(parser, argument, word, unit, value);
        case COMMAND_FLAG:
        case COMMAND_CHOICE:
            return take_choice(parser, argument, word, value);
        case COMMAND_TEXT:
            break;
    }
    const double length = (double)strlen(word);
    const double min = argument->max == 0 ? 1 : argument->min;
    if (length < min) {
        return refuse(parser, argument, ERROR_RANGE, word, " is too short");
    }
    return argument->max > 0 && length > argument->max
               ? refuse(parser, argument, ERROR_RANGE, word, " is too long")
               : ERROR_OK;
}

/// The word after words[*at] if it is the unit of the number there, which ends in a digit: `*at` is
/// then on it. Else "".
static const char *take_unit(const struct command_argument *argument, const char *const *words,
                             size_t word_count, size_t *at) {
    const size_t length = strlen(words[*at]);
    const char last = length > 0 ? words[*at][length - 1] : '\0';
    double ratio = 0;
    const bool follows = is_number(argument) && last >= '0' && last <= '9' &&
                         *at + 1 < word_count &&
                         command_words_unit(words[*at + 1], units_of(argument), &ratio) >= 0;
    *at += follows;
    return follows ? words[*at] : "";
}

/// Length of the option's name in a word that is one; `*name` receives its begin.
static size_t name_of(const char *word, const char **name) {
    *name = word + (strncmp(word, "--", 2) == 0 ? 2 : 0);
    return strcspn(*name, "=");
}

bool command_is_option(const struct command_parser *parser, const char *word) {
    if (strncmp(word, "--", 2) == 0) {
        return word[2] >= 'a' && word[2] <= 'z';
    }
    const size_t letters = strspn(word, "abcdefghijklmnopqrstuvwxyz-");
    return parser->dashes[0] == '\0' && letters > 0 && word[0] != '-' && word[letters] == '=';
}

static const struct command_argument *option_named(const struct command_parser *parser,
                                                   const char *name) {
    for (unsigned i = 0; i < parser->count; i++) {
        if (command_argument_is_option(&parser->arguments[i]) &&
            strcmp(parser->arguments[i].name, name) == 0) {
            return &parser->arguments[i];
        }
    }
    return NULL;
}

/// Proposes the options that are called otherwise elsewhere; false: there are none.
static bool propose_synonyms(const struct command_parser *parser, const char *typed) {
    const char *meant = synonyms_options(typed);
    char name[COMMAND_CHOICE_MAX];
    for (int i = 0; meant != NULL && command_words_choice_at(meant, i, name); i++) {
        if (option_named(parser, name) == NULL) {
            return false;
        }
    }
    for (int i = 0; meant != NULL && command_words_choice_at(meant, i, name); i++) {
        command_text_join(parser->message, i == 0 ? " (did you mean \"" : "\" and \"",
                          parser->dashes, name);
    }
    command_text_add(parser->message, meant != NULL ? "\"?)" : "");
    return meant != NULL;
}

static int unknown_option(const struct command_parser *parser, const char *word) {
    char typed[SUGGEST_WORD_MAX + 1] = "";
    struct suggest suggest;
    const char *name = NULL;
    const size_t length = name_of(word, &name);
    memcpy(typed, name, length < sizeof typed ? length : 0);
    command_text_add(begin(parser), "unknown option ");
    add_quoted(parser->message, word);
    if (propose_synonyms(parser, typed)) {
        return ERROR_ARGUMENT;
    }
    suggest_begin(&suggest, typed, parser->dashes);
    for (unsigned i = 0; i < parser->count; i++) {
        if (command_argument_is_option(&parser->arguments[i])) {
            suggest_consider(&suggest, parser->arguments[i].name);
        }
    }
    command_text_add(parser->message, suggest.text);
    return ERROR_ARGUMENT;
}

int command_parse_option(const struct command_parser *parser, const char *const *words,
                         size_t word_count, size_t *at, struct command_value *values) {
    const char *word = words[*at];
    const char *name = NULL;
    const size_t length = name_of(word, &name);
    unsigned i = 0;
    while (i < parser->count && (!command_argument_is_option(&parser->arguments[i]) ||
                                 strncmp(parser->arguments[i].name, name, length) != 0 ||
                                 parser->arguments[i].name[length] != '\0')) {
        i++;
    }
    if (i == parser->count) {
        return unknown_option(parser, word);
    }
    const struct command_argument *argument = &parser->arguments[i];
    if (name[length] == '=') {
        const char *unit = take_unit(argument, words, word_count, at);
        return take_value(parser, argument, name + length + 1, unit, &values[i]);
    }
    if (argument->kind == COMMAND_FLAG) {
        return take_value(parser, argument, "yes", "", &values[i]);
    }
    if (*at + 1 >= word_count) {
        return refuse(parser, argument, ERROR_MISSING, NULL, " requires a value");
    }
    word = words[++*at];
    const char *unit = take_unit(argument, words, word_count, at);
    return take_value(parser, argument, word, unit, &values[i]);
}

/// Whether the word is a value of this option that used to be given without its name: "left" of
/// side=left, "accept-mismatch" of accept-mismatch=yes.
static bool is_bare_value(const struct command_argument *argument, const char *word) {
    if (!command_argument_is_option(argument)) {
        return false;
    }
    if (argument->kind == COMMAND_FLAG) {
        return strcmp(word, argument->name) == 0;
    }
    return argument->kind == COMMAND_CHOICE && command_words_choice(word, argument->choices) >= 0;
}

/// Rejects a word that is neither an option nor an expected operand, and says what to write.
static int unexpected(const struct command *command, const struct command_parser *parser,
                      const char *word) {
    char usage[COMMAND_USAGE_BYTES];
    command_text_add(begin(parser), "unexpected ");
    add_quoted(parser->message, word);
    for (unsigned i = 0; i < command->argument_count; i++) {
        const struct command_argument *argument = &command->arguments[i];
        if (is_bare_value(argument, word)) {
            command_text_join(parser->message, " (write ", argument->name, "=",
                              argument->kind == COMMAND_FLAG ? "yes" : word, ")");
            return ERROR_ARGUMENT;
        }
    }
    command_usage(command, usage, sizeof usage);
    command_text_join(parser->message, " (usage: ", usage, ")");
    return ERROR_ARGUMENT;
}

/// Takes a word, and a unit after it, as the next operand, which is at `*next` of the arguments.
static int take_operand(const struct command *command, const struct command_parser *parser,
                        const struct command_words *words, size_t *at, unsigned *next,
                        struct command_value *values) {
    const char *word = words->word[*at];
    while (*next < command->argument_count &&
           command_argument_is_option(&command->arguments[*next])) {
        (*next)++;
    }
    if (*next == command->argument_count || strcmp(word, "-") == 0) {
        return unexpected(command, parser, word);
    }
    for (unsigned i = 0; i < command->argument_count; i++) {
        if (is_number(&command->arguments[*next]) && is_bare_value(&command->arguments[i], word)) {
            return unexpected(command, parser, word);
        }
    }
    const unsigned i = (*next)++;
    const char *unit = take_unit(&command->arguments[i], words->word, words->count, at);
    return take_value(parser, &command->arguments[i], word, unit, &values[i]);
}

static int parse_arguments(const struct command *command, const struct command_words *words,
                           struct command_value *values, struct command_text *message) {
    const struct command_parser parser = {command->name, command->arguments,
                                          command->argument_count, "", message};
    unsigned next = 0;
    int error = ERROR_OK;
    INVARIANT(command->argument_count <= COMMAND_ARGUMENTS_MAX);
    for (unsigned i = 0; i < command->argument_count; i++) {
        values[i] = (struct command_value){.choice = -1};
    }
    for (size_t at = 1; at < words->count && error == ERROR_OK; at++) {
        const bool quoted = (words->quoted >> at & 1) != 0;
        error = !quoted && command_is_option(&parser, words->word[at])
                    ? command_parse_option(&parser, words->word, words->count, &at, values)
                    : take_operand(command, &parser, words, &at, &next, values);
    }
    for (unsigned i = 0; error == ERROR_OK && i < command->argument_count; i++) {
        const struct command_argument *argument = &command->arguments[i];
        if (!values[i].given && !argument->optional && !command_argument_is_option(argument)) {
            error = refuse(&parser, argument, ERROR_MISSING, NULL, " is missing");
        }
    }
    return error;
}

int command_parse(const char *line, const struct command *table, size_t count, char *storage,
                  struct command_value *values, const struct command **found, char *message,
                  size_t message_bytes) {
    struct command_text text = command_text_begin(message, message_bytes);
    struct command_words words;
    const char *why = NULL;
    *found = NULL;
    int error = command_words_split(line, storage, &words, &why);
    if (error != ERROR_OK) {
        command_text_add(&text, why);
        return error;
    }
    if (words.count == 0) {
        return ERROR_OK;
    }
    const struct command *command = command_find(table, count, words.word[0]);
    if (command == NULL) {
        return command_unknown(table, count, words.word[0], &text);
    }
    const char *meant = words.count > 1 ? synonyms_command(command->name, words.word[1]) : NULL;
    if (meant != NULL && command_find(table, count, meant) != NULL) {
        command_text_join(&text, command->name, ": unexpected \"", words.word[1],
                          "\" (did you mean \"", meant, "\"?)");
        return ERROR_ARGUMENT;
    }
    error = parse_arguments(command, &words, values, &text);
    *found = error == ERROR_OK ? command : NULL;
    return error;
}

struct command_table command_join(const struct command *(*const tables[])(size_t *),
                                  size_t table_count, struct command *all, size_t capacity) {
    size_t count = 0;
    for (size_t i = 0; i < table_count; i++) {
        size_t more = 0;
        const struct command *table = tables[i](&more);
        INVARIANT(count + more <= capacity);
        memcpy(all + count, table, more * sizeof *all);
        count += more;
    }
    return (struct command_table){all, count};
}
