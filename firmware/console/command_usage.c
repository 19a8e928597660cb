// SPDX-License-Identifier: Apache-2.0
// Usage and limits of arguments, for help and messages.
#include <math.h>
#include <string.h>

#include "console/command.h"
#include "core/invariant.h"

const char *command_choices(const struct command_argument *argument) {
    INVARIANT(argument->kind == COMMAND_FLAG || argument->choices != NULL);
    return argument->kind == COMMAND_FLAG ? "no yes" : argument->choices;
}

/// Adds the words of a choice, separated by `between`, and by `last` before the last one.
static void add_choices(struct command_text *text, const char *choices, const char *between,
                        const char *last) {
    char word[COMMAND_CHOICE_MAX];
    char next[COMMAND_CHOICE_MAX];
    for (int i = 0; command_words_choice_at(choices, i, word); i++) {
        const bool more = command_words_choice_at(choices, i + 1, next);
        const char *separator = more ? between : last;
        command_text_join(text, i == 0 ? "" : separator, word);
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
            add_choices(text, command_choices(argument), ", ", " or ");
            break;
        case COMMAND_TEXT:
            if (argument->max == 0) {
                command_text_add(text,
                                 argument->value_name != NULL ? argument->value_name : "text");
                break;
            }
            command_text_add(text, "text of ");
            command_text_add_number(text, argument->min, 0);
            if (argument->max > argument->min) {
                command_text_add(text, " to ");
                command_text_add_number(text, argument->max, 0);
            }
            command_text_add(text, " characters");
            break;
    }
}
