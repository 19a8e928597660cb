// SPDX-License-Identifier: Apache-2.0
#include "console/command.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/suggest.h"

enum { NUMBER_BYTES = 32 };

static const char flag_choices[] = "no yes";

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
    struct suggest suggest;
    suggest_begin(&suggest, name, "");
    for (size_t i = 0; i < count; i++) {
        suggest_consider(&suggest, table[i].name);
    }
    command_text_add(message, "unknown command \"");
    command_text_add_typed(message, name);
    command_text_add(message, "\"");
    command_text_add(message,
                     suggest.text[0] != '\0' ? suggest.text : " (\"help\" lists all commands)");
    return ERROR_ARGUMENT;
}

bool command_argument_is_option(const struct command_argument *argument) {
    return argument->name[0] >= 'a' && argument->name[0] <= 'z';
}

/// The words of a choice or a flag.
static const char *choices_of(const struct command_argument *argument) {
    INVARIANT(argument->kind == COMMAND_FLAG || argument->choices != NULL);
    return argument->kind == COMMAND_FLAG ? flag_choices : argument->choices;
}

/// Adds the words of a choice, separated by `between`, and by `last` before the last one.
static void add_choices(struct command_text *text, const char *choices, const char *between,
                        const char *last) {
    char word[COMMAND_CHOICE_MAX];
    char next[COMMAND_CHOICE_MAX];
    for (int i = 0; command_words_choice_at(choices, i, word); i++) {
        const bool more = command_words_choice_at(choices, i + 1, next);
        command_text_join(text, i == 0 ? "" : more ? between : last, word);
    }
}

static void add_option_usage(struct command_text *usage, const struct command_argument *argument) {
    command_text_join(usage, " [", argument->name, "=");
    if (argument->kind == COMMAND_FLAG) {
        command_text_add(usage, "yes");
    } else if (argument->kind == COMMAND_CHOICE) {
        add_choices(usage, argument->choices, "|", "|");
    } else {
        command_text_add(usage, argument->value_name != NULL ? argument->value_name : "N");
    }
    command_text_add(usage, "]");
}

void command_usage(const struct command *command, char *text, size_t bytes) {
    struct command_text usage = command_text_begin(text, bytes);
    command_text_add(&usage, command->name);
    for (unsigned i = 0; i < command->argument_count; i++) {
        const struct command_argument *argument = &command->arguments[i];
        if (command_argument_is_option(argument)) {
            add_option_usage(&usage, argument);
            continue;
        }
        command_text_join(&usage, argument->optional ? " [" : " ", argument->name,
                          argument->optional ? "]" : "");
    }
}

static void expect_number(const struct command_argument *argument, struct command_text *text) {
    const bool whole = argument->kind == COMMAND_INTEGER;
    if (argument->count > 1) {
        command_text_join(text, argument->value_name, whole ? ", integers" : ", numbers");
    } else {
        command_text_add(text, whole ? "an integer" : "a number");
    }
    command_text_add(text, isinf(argument->max) ? " of at least " : " from ");
    command_text_add_number(text, argument->min, 6);
    if (!isinf(argument->max)) {
        command_text_add(text, " to ");
        command_text_add_number(text, argument->max, 6);
    }
    command_text_add_unit(text, argument->unit);
    command_text_add(text, isinf(argument->max) ? ", or inf" : "");
    char word[COMMAND_CHOICE_MAX];
    for (int i = 1; argument->units != NULL && command_words_choice_at(argument->units, i, word);
         i++) {
        const bool leads = word[strlen(word) - 1] == '/';
        command_text_join(text, leads ? ", or " : ", or N ", word, leads ? "N" : "");
    }
    if (argument->choices != NULL) {
        command_text_add(text, ", or ");
        add_choices(text, argument->choices, ", ", " or ");
    }
}

void command_expected(const struct command_argument *argument, struct command_text *text) {
    switch (argument->kind) {
        case COMMAND_NUMBER:
        case COMMAND_INTEGER:
            expect_number(argument, text);
            break;
        case COMMAND_FLAG:
        case COMMAND_CHOICE:
            add_choices(text, choices_of(argument), ", ", " or ");
            break;
        case COMMAND_TEXT:
            if (argument->max == 0) {
                command_text_add(text,
                                 argument->value_name != NULL ? argument->value_name : "text");
                break;
            }
            command_text_add(text, "text of ");
            command_text_add_number(text, argument->min, 0);
            command_text_add(text, " to ");
            command_text_add_number(text, argument->max, 0);
            command_text_add(text, " characters");
            break;
    }
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

/// Reads a number from `text`, which has no other characters.
static int read_number(const struct command_argument *argument, const char *text, double *number,
                       int64_t *integer) {
    if (argument->kind == COMMAND_INTEGER) {
        const bool valid = command_words_integer(text, integer);
        *number = (double)*integer;
        return valid ? 0 : ERROR_SYNTAX;
    }
    if (isinf(argument->max) && strcmp(text, "inf") == 0) {
        *number = INFINITY;
        return 0;
    }
    const bool valid = command_words_number(text, number);
    *integer = valid ? (int64_t)*number : 0;
    return valid ? 0 : ERROR_SYNTAX;
}

/// Takes the number at `at`, which ends at `end`; NULL: it does not end where it should.
static int take_number(const struct command_parser *parser, const struct command_argument *argument,
                       const char *word, const char *at, const char *end, double *number,
                       int64_t *integer) {
    char text[NUMBER_BYTES];
    const size_t length = end != NULL ? (size_t)(end - at) : sizeof text;
    int error = ERROR_SYNTAX;
    if (length < sizeof text) {
        memcpy(text, at, length);
        text[length] = '\0';
        error = read_number(argument, text, number, integer);
    }
    if (error != 0) {
        return refuse(parser, argument, error, word,
                      argument->count > 1                 ? " is invalid"
                      : argument->kind == COMMAND_INTEGER ? " is not an integer"
                                                          : " is not a number");
    }
    if (*number < argument->min) {
        return refuse(parser, argument, ERROR_RANGE, word, " is too small");
    }
    return *number > argument->max ? refuse(parser, argument, ERROR_RANGE, word, " is too large")
                                   : 0;
}

static int take_numbers(const struct command_parser *parser,
                        const struct command_argument *argument, const char *word,
                        struct command_value *value) {
    const int count = argument->count > 0 ? argument->count : 1;
    const char *at = word;
    INVARIANT(count <= COMMAND_NUMBERS_MAX);
    for (int i = 0; i < count; i++) {
        const bool last = i + 1 == count;
        int64_t integer = 0;
        const char *end = last ? at + strlen(at) : strchr(at, argument->separator);
        end = end == NULL && argument->separator == 'x' ? strchr(at, 'X') : end;  // 9X6
        const int error =
            take_number(parser, argument, word, at, end, &value->numbers[i], &integer);
        if (error != 0) {
            return error;
        }
        at = last ? end : end + 1;
        value->integer = i == 0 ? integer : value->integer;
    }
    return 0;
}

/// Takes a number with one of several units, or a word in place of it. `unit`: that of a next word,
/// -1: none.
static int take_quantity(const struct command_parser *parser,
                         const struct command_argument *argument, const char *word, int unit,
                         struct command_value *value) {
    char text[NUMBER_BYTES];
    const char *number = word;
    *value = (struct command_value){.given = true, .choice = -1, .text = word};
    if (unit < 0 && argument->choices != NULL) {
        value->choice = command_words_choice(word, argument->choices);
    }
    if (value->choice >= 0) {
        return 0;
    }
    if (unit < 0 && argument->units != NULL) {
        unit = command_words_unit(word, argument->units, text, sizeof text);
        number = unit >= 0 ? text : word;
    }
    if (unit <= 0) {
        return take_number(parser, argument, word, number, number + strlen(number), &value->number,
                           &value->integer);
    }
    value->unit = unit;
    if (!command_words_number(number, &value->number)) {
        return refuse(parser, argument, ERROR_SYNTAX, word, " is not a number");
    }
    return value->number > 0 ? 0 : refuse(parser, argument, ERROR_RANGE, word, " is too small");
}

static int take_choice(const struct command_parser *parser, const struct command_argument *argument,
                       const char *word, struct command_value *value) {
    struct command_text *message = parser->message;
    struct suggest suggest;
    value->choice = command_words_choice(word, choices_of(argument));
    if (value->choice >= 0) {
        return 0;
    }
    suggest_begin(&suggest, word, "");
    suggest_consider_all(&suggest, choices_of(argument));
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

static int take_value(const struct command_parser *parser, const struct command_argument *argument,
                      const char *word, struct command_value *value) {
    *value = (struct command_value){.given = true, .choice = -1, .text = word};
    switch (argument->kind) {
        case COMMAND_NUMBER:
        case COMMAND_INTEGER:
            return take_numbers(parser, argument, word, value);
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
               : 0;
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

static int unknown_option(const struct command_parser *parser, const char *word) {
    char typed[SUGGEST_WORD_MAX + 1] = "";
    struct suggest suggest;
    const char *name = NULL;
    const size_t length = name_of(word, &name);
    memcpy(typed, name, length < sizeof typed ? length : 0);
    suggest_begin(&suggest, typed, parser->dashes);
    for (unsigned i = 0; i < parser->count; i++) {
        if (command_argument_is_option(&parser->arguments[i])) {
            suggest_consider(&suggest, parser->arguments[i].name);
        }
    }
    command_text_add(begin(parser), "unknown option ");
    add_quoted(parser->message, word);
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
        return take_value(parser, argument, name + length + 1, &values[i]);
    }
    if (argument->kind == COMMAND_FLAG) {
        return take_value(parser, argument, "yes", &values[i]);
    }
    if (*at + 1 >= word_count) {
        return refuse(parser, argument, ERROR_MISSING, NULL, " requires a value");
    }
    (*at)++;
    return take_value(parser, argument, words[*at], &values[i]);
}

/// Whether the word is a value of this option that used to be given without its name: "left" of
/// side=left, "accept-mismatch" of accept-mismatch=yes.
static bool is_bare_value(const struct command_argument *argument, const char *word) {
    if (!command_argument_is_option(argument)) {
        return false;
    }
    return argument->kind == COMMAND_FLAG     ? strcmp(word, argument->name) == 0
           : argument->kind == COMMAND_CHOICE ? command_words_choice(word, argument->choices) >= 0
                                              : false;
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
        const enum command_kind kind = command->arguments[*next].kind;
        if ((kind == COMMAND_NUMBER || kind == COMMAND_INTEGER) &&
            is_bare_value(&command->arguments[i], word)) {
            return unexpected(command, parser, word);
        }
    }
    const unsigned i = (*next)++;
    const char *units = command->arguments[i].units;
    if (units == NULL) {
        return take_value(parser, &command->arguments[i], word, &values[i]);
    }
    const int unit =
        *at + 1 < words->count ? command_words_choice(words->word[*at + 1], units) : -1;
    *at += unit >= 0 ? 1 : 0;
    return take_quantity(parser, &command->arguments[i], word, unit, &values[i]);
}

static int parse_arguments(const struct command *command, const struct command_words *words,
                           struct command_value *values, struct command_text *message) {
    const struct command_parser parser = {command->name, command->arguments,
                                          command->argument_count, "", message};
    unsigned next = 0;
    int error = 0;
    INVARIANT(command->argument_count <= COMMAND_ARGUMENTS_MAX);
    for (unsigned i = 0; i < command->argument_count; i++) {
        values[i] = (struct command_value){.choice = -1};
    }
    for (size_t at = 1; at < words->count && error == 0; at++) {
        const bool quoted = (words->quoted >> at & 1) != 0;
        error = !quoted && command_is_option(&parser, words->word[at])
                    ? command_parse_option(&parser, words->word, words->count, &at, values)
                    : take_operand(command, &parser, words, &at, &next, values);
    }
    for (unsigned i = 0; error == 0 && i < command->argument_count; i++) {
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
    if (error != 0) {
        command_text_add(&text, why);
        return error;
    }
    if (words.count == 0) {
        return 0;
    }
    const struct command *command = command_find(table, count, words.word[0]);
    if (command == NULL) {
        return command_unknown(table, count, words.word[0], &text);
    }
    error = parse_arguments(command, &words, values, &text);
    *found = error == 0 ? command : NULL;
    return error;
}
