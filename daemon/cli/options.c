// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/options.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/base/process.h"
#include "daemon/cli/help.h"

enum { MANUAL_SECTION = 1 };

/// Prints the form of the page that an argument asks for. False: not such an argument.
static bool print_help(const struct option_page *page, const char *argument) {
    if (strcmp(argument, "--help") == 0 || strcmp(argument, "-h") == 0) {
        options_help_print(page, stdout);
    } else if (strcmp(argument, "--help-man") == 0) {
        manual_options(stdout, page, MANUAL_SECTION);
        manual_heading(stdout, "SEE ALSO");
        manual_reference(stdout, "", "vergence", MANUAL_SECTION, true);
    } else if (strcmp(argument, "--help-words") == 0) {
        shell_completion_options(stdout, page);
    } else {
        return false;
    }
    return true;
}

/// Prints the help that one of the arguments asks for: it must work even if the rest of the line is
/// wrong. False: none does.
static bool find_help(const struct option_page *page, int argc, char **argv) {
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        if (print_help(page, argv[i])) {
            return true;
        }
    }
    return false;
}

/// Parses all words. Errors of command_parse, with a message.
static int parse_words(const struct option_page *page, const struct command_parser *parser,
                       int argc, char **argv, struct command_value *values, const char **operands,
                       int *operand_count) {
    const char *const *words = (const char *const *)argv;
    bool only_operands = false;
    int taken = 0;
    for (size_t i = 1; i < (size_t)argc; i++) {
        const char *word = words[i];
        if (!only_operands && strcmp(word, "--") == 0) {
            only_operands = true;
        } else if (!only_operands && word[0] == '-' && word[1] != '\0') {
            const int error = command_parse_option(parser, words, (size_t)argc, &i, values);
            if (error != ERROR_OK) {
                return error;
            }
        } else if (taken < page->operands_max) {
            operands[taken++] = word;
        } else {
            command_text_add(parser->message, parser->command);
            command_text_add(parser->message, ": unexpected argument \"");
            command_text_add_typed(parser->message, word);
            command_text_add(parser->message, "\" (expected ");
            command_text_add(parser->message,
                             page->operands_max > 0 ? page->operands : "no arguments");
            command_text_add(parser->message, ")");
            return ERROR_ARGUMENT;
        }
    }
    *operand_count = taken;
    if (taken < page->operands_min) {
        command_text_add(parser->message, parser->command);
        command_text_add(parser->message, ": missing argument (expected ");
        command_text_add(parser->message, page->operands);
        command_text_add(parser->message, ")");
        return ERROR_MISSING;
    }
    return ERROR_OK;
}

/// A length with its unit beside --unit, which is that of lengths without one.
static bool is_unit_given_twice(const struct option_page *page, const struct command_value *values,
                                struct command_text *message) {
    bool given = false;
    for (unsigned i = 0; i < page->option_count; i++) {
        given = given || (values[i].given && strcmp(page->options[i].name, "unit") == 0);
    }
    for (unsigned i = 0; given && i < page->option_count; i++) {
        if (values[i].given && values[i].stated) {
            command_text_join(message, page->command, ": --", page->options[i].name,
                              " has its unit already (leave out --unit)");
            return true;
        }
    }
    return false;
}

int options_read(const struct option_page *page, int argc, char **argv, void *values,
                 const char **operands, int *operand_count, struct message *message) {
    struct command_value given[COMMAND_ARGUMENTS_MAX] = {{.given = false}};
    struct command_text text = command_text_begin(message->text, sizeof message->text);
    const struct command_parser parser = {page->command, page->options, page->option_count, "--",
                                          &text};
    INVARIANT(page->option_count <= COMMAND_ARGUMENTS_MAX);
    if (parse_words(page, &parser, argc, argv, given, operands, operand_count) != 0 ||
        is_unit_given_twice(page, given, &text)) {
        const size_t name = strlen(page->command) + 2;  // "COMMAND: "
        memmove(message->text, message->text + name, strlen(message->text + name) + 1);
        return ERROR_ARGUMENT;
    }
    command_store(page->options, page->option_count, given, values);
    return ERROR_OK;
}

size_t options_value_bytes(const struct command_argument *option) {
    const size_t numbers = option->count > 0 ? (size_t)option->count : 1;
    switch (option->kind) {
        case COMMAND_FLAG:
            return sizeof(bool);
        case COMMAND_TEXT:
            return sizeof(const char *);
        case COMMAND_NUMBER:
            return numbers * sizeof(double);
        default:
            return numbers * sizeof(int);
    }
}

int options_exit_code(int error) {
    if (error == ERROR_CANCELLED) {
        return interrupt_exit_code();
    }
    return error == ERROR_MEMORY ? CLIENT_FAILED : CLIENT_BAD_INPUT;
}

static bool is_listed(const char *names, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = names; at != NULL; at = strchr(at, ' ')) {
        at += *at == ' ';
        if (strncmp(at, name, length) == 0 && (at[length] == ' ' || at[length] == '\0')) {
            return true;
        }
    }
    return false;
}

const char *options_find_other(const struct option_page *page, const char *names,
                               const void *values, const void *defaults) {
    for (unsigned i = 0; i < page->option_count; i++) {
        const struct command_argument *option = &page->options[i];
        if (!is_listed(names, option->name) &&
            memcmp((const char *)values + option->offset, (const char *)defaults + option->offset,
                   options_value_bytes(option)) != 0) {
            return option->name;
        }
    }
    return NULL;
}

void options_rename(int argc, char **argv, const char *old, const char *now) {
    static char renamed[64];
    const size_t length = strlen(old);
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
        if (strncmp(argv[i], old, length) == 0 &&
            (argv[i][length] == '\0' || argv[i][length] == '=')) {
            snprintf(renamed, sizeof renamed, "%s%s", now, argv[i] + length);
            fprintf(stderr, "vergence: note: %s is now %s\n", old, now);
            argv[i] = renamed;
        }
    }
}

int options_parse(const struct option_page *page, int argc, char **argv, void *values,
                  const char **operands, int *operand_count) {
    struct message message;
    if (find_help(page, argc, argv)) {
        return CLIENT_OK;
    }
    if (options_read(page, argc, argv, values, operands, operand_count, &message) != ERROR_OK) {
        fprintf(stderr, "%s: %s; see \"%s --help\"\n", page->command, message.text, page->command);
        return CLIENT_USAGE;
    }
    return OPTIONS_CONTINUE;
}
