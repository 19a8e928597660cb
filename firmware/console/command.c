// SPDX-License-Identifier: Apache-2.0
#include "console/command.h"

#include <string.h>

#include "console/command_text.h"
#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"

enum { NEAR = 2 };  // a larger distance means another word

/// What a message about an argument needs.
struct place {
    const struct command *command;
    const struct command_argument *argument;
    struct command_text *sentence;
};

const struct command *command_find(const struct command *table, size_t count, const char *name) {
    for (size_t i = 0; i < count; i++) {
        if (strcmp(table[i].name, name) == 0) {
            return &table[i];
        }
    }
    return NULL;
}

/// Whether `distance` is small enough for a typo: at least half of the letters must be right, as a
/// short word is close to anything.
static bool is_near(const char *word, const char *other, int distance) {
    const size_t length = strlen(word) > strlen(other) ? strlen(word) : strlen(other);
    return distance <= NEAR && 2 * (size_t)distance <= length;
}

const char *command_nearest(const struct command *table, size_t count, const char *name) {
    const char *nearest = NULL;
    int min = NEAR + 1;
    for (size_t i = 0; i < count; i++) {
        const int distance = command_words_distance(name, table[i].name);
        if (distance < min && is_near(name, table[i].name, distance)) {
            min = distance;
            nearest = table[i].name;
        }
    }
    return nearest;
}

void command_usage(const struct command *command, char *text, size_t bytes) {
    struct command_text usage = command_text_begin(text, bytes);
    command_text_add(&usage, command->name);
    for (unsigned i = 0; i < command->argument_count; i++) {
        const struct command_argument *argument = &command->arguments[i];
        command_text_add(&usage, argument->optional ? " [" : " ");
        command_text_add(&usage, argument->name);
        command_text_add(&usage, argument->optional ? "]" : "");
    }
}

/// "left, right or both".
static void add_choices(struct command_text *sentence, const char *choices) {
    char word[COMMAND_CHOICE_MAX];
    char next[COMMAND_CHOICE_MAX];
    for (int i = 0; command_words_choice_at(choices, i, word); i++) {
        const bool last = !command_words_choice_at(choices, i + 1, next);
        command_text_add(sentence, i == 0 ? "" : last ? " or " : ", ");
        command_text_add(sentence, word);
    }
}

/// Adds the accepted values.
static void add_wanted(const struct place *place) {
    const struct command_argument *argument = place->argument;
    struct command_text *sentence = place->sentence;
    switch (argument->kind) {
        case COMMAND_NUMBER:
        case COMMAND_INTEGER:
            command_text_add(
                sentence, argument->kind == COMMAND_NUMBER ? "a number from " : "an integer from ");
            command_text_add_number(sentence, argument->min, 6);
            command_text_add(sentence, " to ");
            command_text_add_number(sentence, argument->max, 6);
            command_text_add_unit(sentence, argument->unit);
            break;
        case COMMAND_CHOICE:
            add_choices(sentence, argument->choices);
            break;
        case COMMAND_TEXT:
            command_text_add(sentence, "text of ");
            command_text_add_number(sentence, argument->min, 0);
            command_text_add(sentence, " to ");
            command_text_add_number(sentence, argument->max, 0);
            command_text_add(sentence, " characters");
            break;
    }
}

/// Writes `pan: ANGLE "x" is not a number (expected ...)`.
static int refuse(const struct place *place, int error, const char *word, const char *what) {
    INVARIANT(error < 0);
    const bool unknown = place->argument->kind == COMMAND_CHOICE && word != NULL;
    command_text_add(place->sentence, place->command->name);
    command_text_add(place->sentence, unknown ? ": unknown " : ": ");
    command_text_add(place->sentence, place->argument->name);
    if (word != NULL) {
        command_text_add(place->sentence, " \"");
        command_text_add_typed(place->sentence, word);
        command_text_add(place->sentence, "\"");
    }
    command_text_add(place->sentence, what);
    command_text_add(place->sentence, " (expected ");
    add_wanted(place);
    command_text_add(place->sentence, ")");
    return error;
}

static int take_number(const struct place *place, const char *word, struct command_value *value) {
    const struct command_argument *argument = place->argument;
    if (argument->kind == COMMAND_INTEGER) {
        if (!command_words_integer(word, &value->integer)) {
            return refuse(place, ERROR_SYNTAX, word, " is not an integer");
        }
        value->number = (double)value->integer;
    } else {
        if (!command_words_number(word, &value->number)) {
            return refuse(place, ERROR_SYNTAX, word, " is not a number");
        }
        value->integer = (int64_t)value->number;
    }
    if (value->number < argument->min || value->number > argument->max) {
        const bool small = value->number < argument->min;
        return refuse(place, ERROR_RANGE, word, small ? " is too small" : " is too large");
    }
    return 0;
}

static int take_choice(const struct place *place, const char *word, struct command_value *value) {
    const char *choices = place->argument->choices;
    value->choice = command_words_choice(word, choices);
    if (value->choice >= 0) {
        return 0;
    }
    const int error = refuse(place, ERROR_ARGUMENT, word, "");
    char choice[COMMAND_CHOICE_MAX];
    for (int i = 0; command_words_choice_at(choices, i, choice); i++) {
        if (is_near(word, choice, command_words_distance(word, choice))) {
            command_text_add(place->sentence, "; did you mean \"");
            command_text_add(place->sentence, choice);
            command_text_add(place->sentence, "\"?");
            break;
        }
    }
    return error;
}

static int take_value(const struct place *place, const char *word, struct command_value *value) {
    const struct command_argument *argument = place->argument;
    INVARIANT(argument->kind != COMMAND_CHOICE || argument->choices != NULL);
    value->given = true;
    value->text = word;
    switch (argument->kind) {
        case COMMAND_NUMBER:
        case COMMAND_INTEGER:
            return take_number(place, word, value);
        case COMMAND_CHOICE:
            return take_choice(place, word, value);
        case COMMAND_TEXT:
            break;
    }
    const double length = (double)strlen(word);
    if (length < argument->min || length > argument->max) {
        return refuse(place, ERROR_RANGE, word,
                      length < argument->min ? " is too short" : " is too long");
    }
    return 0;
}

static int unknown_command(const struct command *table, size_t count, const char *name,
                           struct command_text *sentence) {
    const char *nearest = command_nearest(table, count, name);
    command_text_add(sentence, "unknown command \"");
    command_text_add_typed(sentence, name);
    if (nearest != NULL) {
        command_text_add(sentence, "\"; did you mean \"");
        command_text_add(sentence, nearest);
        command_text_add(sentence, "\"?");
    } else {
        command_text_add(sentence, "\" (\"help\" lists all commands)");
    }
    return ERROR_ARGUMENT;
}

static int too_many(const struct command *command, const char *word,
                    struct command_text *sentence) {
    char usage[128];
    command_usage(command, usage, sizeof usage);
    command_text_add(sentence, command->name);
    command_text_add(sentence, ": unexpected \"");
    command_text_add_typed(sentence, word);
    command_text_add(sentence, "\" (usage: ");
    command_text_add(sentence, usage);
    command_text_add(sentence, ")");
    return ERROR_ARGUMENT;
}

/// Whether a later choice accepts this word, and all arguments up to it are optional.
static bool later_choice_has(const struct command *command, unsigned place, const char *word) {
    for (unsigned i = place + 1; i < command->argument_count; i++) {
        const struct command_argument *later = &command->arguments[i];
        if (!later->optional) {
            return false;
        }
        if (later->kind == COMMAND_CHOICE && command_words_choice(word, later->choices) >= 0) {
            return true;
        }
    }
    return false;
}

/// Whether the argument is a number and the word can be one.
static bool takes_number(const struct command_argument *argument, const char *word) {
    double number = 0;
    int64_t integer = 0;
    return (argument->kind == COMMAND_NUMBER || argument->kind == COMMAND_INTEGER) &&
           (command_words_number(word, &number) || command_words_integer(word, &integer));
}

/// Whether the word belongs to a later argument, so that this one was left out. "exposure 5000"
/// leaves out the camera choice: the word is the number after it. "capture static" leaves out a
/// name, but only if the word is the last one, as a name may be "static". "reconstruct scene
/// accept-mismatch" leaves out numbers.
static bool is_left_out(const struct command *command, unsigned place, const char *word,
                        bool is_last) {
    const struct command_argument *argument = &command->arguments[place];
    if (!argument->optional || place + 1 >= command->argument_count) {
        return false;
    }
    switch (argument->kind) {
        case COMMAND_CHOICE:
            return command_words_choice(word, argument->choices) < 0 &&
                   (later_choice_has(command, place, word) || takes_number(argument + 1, word));
        case COMMAND_TEXT:
            return is_last && later_choice_has(command, place, word);
        case COMMAND_NUMBER:
        case COMMAND_INTEGER:
            return later_choice_has(command, place, word);
    }
    return false;
}

int command_parse(const char *line, const struct command *table, size_t count, char *storage,
                  struct command_value *values, const struct command **found, char *message,
                  size_t message_bytes) {
    struct command_text sentence = command_text_begin(message, message_bytes);
    const char *words[COMMAND_WORDS_MAX];
    size_t word_count = 0;
    const char *why = NULL;
    const int error = command_words_split(line, storage, words, &word_count, &why);
    if (error != 0) {
        command_text_add(&sentence, why);
        return error;
    }
    *found = NULL;
    if (word_count == 0) {
        return 0;
    }
    const struct command *command = command_find(table, count, words[0]);
    if (command == NULL) {
        return unknown_command(table, count, words[0], &sentence);
    }
    INVARIANT(command->argument_count <= COMMAND_ARGUMENTS_MAX);
    if (word_count - 1 > command->argument_count) {
        return too_many(command, words[command->argument_count + 1], &sentence);
    }
    size_t next = 1;
    for (unsigned i = 0; i < command->argument_count; i++) {
        const struct place place = {command, &command->arguments[i], &sentence};
        values[i] = (struct command_value){.choice = -1};
        int wrong = 0;
        if (next < word_count && is_left_out(command, i, words[next], next + 1 == word_count)) {
            continue;
        }
        if (next < word_count) {
            wrong = take_value(&place, words[next++], &values[i]);
        } else if (!command->arguments[i].optional) {
            wrong = refuse(&place, ERROR_MISSING, NULL, " is missing");
        }
        if (wrong != 0) {
            return wrong;
        }
    }
    if (next < word_count) {
        return too_many(command, words[next], &sentence);
    }
    *found = command;
    return 0;
}
