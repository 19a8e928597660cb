// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/options.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/cli/exit_code.h"
#include "daemon/cli/manual.h"
#include "daemon/cli/options_help.h"
#include "daemon/cli/shell_completion.h"

enum {
    OPTIONS_NAMES_MAX = 64,
    OPTIONS_WORD_MAX = 32,
    NUMBERS_MAX = 8,
    NUMBER_TEXT_MAX = 64,
    MANUAL_SECTION = 1
};

/// Reports an error in one line and returns its exit code.
static int refuse(const struct option_page *page, const struct message *mistake) {
    fprintf(stderr, "%s: %s; see \"%s --help\"\n", page->command, mistake->text, page->command);
    return CLIENT_USAGE;
}

static int edit_distance(const char *a, const char *b) {
    int row[OPTIONS_WORD_MAX + 1];
    const int length_b = (int)strlen(b);
    for (int j = 0; j <= length_b; j++) {
        row[j] = j;
    }
    for (int i = 1; a[i - 1] != '\0'; i++) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= length_b; j++) {
            const int replaced = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            const int gap = (row[j] < row[j - 1] ? row[j] : row[j - 1]) + 1;
            row[j] = replaced < gap ? replaced : gap;
        }
    }
    return row[length_b];
}

const char *options_closest(const char *typed, const char *const *candidates, int count) {
    const char *closest = NULL;
    int nearest = 3;  // more than two edits make another word
    const size_t length = strlen(typed);
    if (length > OPTIONS_WORD_MAX) {
        return NULL;
    }
    for (int i = 0; i < count; i++) {
        const size_t other = strlen(candidates[i]);
        INVARIANT(other <= OPTIONS_WORD_MAX);
        const bool begins = length >= 3 && strncmp(typed, candidates[i], length) == 0;
        const int distance = begins ? 1 : edit_distance(typed, candidates[i]);
        // Short words are near to anything: at least half of the word must match.
        if (distance < nearest && 2 * (size_t)distance <= (length > other ? length : other)) {
            nearest = distance;
            closest = candidates[i];
        }
    }
    return closest;
}

static const struct option *find_option(const struct option_page *page, const char *name,
                                        size_t length) {
    for (int i = 0; i < page->option_count; i++) {
        const char *candidate = page->options[i].name;
        if (strlen(candidate) == length && strncmp(candidate, name, length) == 0) {
            return &page->options[i];
        }
    }
    return NULL;
}

static void format_number(char text[NUMBER_TEXT_MAX], double value) {
    snprintf(text, NUMBER_TEXT_MAX, "%.10g", value);
}

/// Reads one number and moves `*text` past it.
static bool scan_number(const struct option *option, const char **text, double *value) {
    char *end = NULL;
    errno = 0;
    if (option->kind == OPTION_INT) {
        *value = (double)strtol(*text, &end, 10);
    } else {
        *value = strtod(*text, &end);
    }
    // strtod also accepts white space, "nan" and hexadecimal floats, which are not allowed here.
    const char first = **text;
    const bool typed = isalpha((unsigned char)first) != 0;
    const bool plain = !isspace((unsigned char)first) && errno == 0 && end != *text &&
                       memchr(*text, 'x', (size_t)(end - *text)) == NULL &&
                       (!typed || strncmp(*text, "inf", 3) == 0) && !isnan(*value);
    *text = end;
    return plain;
}

static int set_numbers(const struct option *option, const char *text, void *value,
                       struct message *mistake) {
    const int count = option->count > 0 ? option->count : 1;
    double numbers[NUMBERS_MAX];
    INVARIANT(count <= NUMBERS_MAX);
    const char *at = text;
    bool good = true;
    for (int i = 0; i < count && good; i++) {
        good = scan_number(option, &at, &numbers[i]);
        const char expected = i + 1 < count ? option->separator : '\0';
        good = good && tolower((unsigned char)*at) == expected;  // sizes may be written 9X6
        at += expected != '\0';
    }
    if (!good) {
        return message_set(mistake, CLIENT_USAGE, "--%s: invalid value \"%s\" (expected %s)",
                           option->name, text, option->value_name);
    }
    for (int i = 0; i < count; i++) {
        if (numbers[i] < option->minimum || numbers[i] > option->maximum) {
            char low[NUMBER_TEXT_MAX], high[NUMBER_TEXT_MAX];
            format_number(low, option->minimum);
            format_number(high, option->maximum);
            return message_set(mistake, CLIENT_USAGE,
                               "--%s: \"%s\" is out of range (expected %s to %s)", option->name,
                               text, low, high);
        }
    }
    for (int i = 0; i < count; i++) {
        if (option->kind == OPTION_INT) {
            ((int *)value)[i] = (int)numbers[i];
        } else {
            ((double *)value)[i] = numbers[i];
        }
    }
    return OPTIONS_CONTINUE;
}

static int set_choice(const struct option *option, const char *text, int *value,
                      struct message *mistake) {
    const size_t length = strlen(text);
    int place = 0;
    for (const char *choice = option->choices; *choice != '\0'; place++) {
        const size_t choice_length = strcspn(choice, " ");
        if (choice_length == length && strncmp(choice, text, length) == 0) {
            *value = place;
            return OPTIONS_CONTINUE;
        }
        choice += choice_length + strspn(choice + choice_length, " ");
    }
    return message_set(mistake, CLIENT_USAGE, "--%s: unknown value \"%s\" (expected one of: %s)",
                       option->name, text, option->choices);
}

static int set_value(const struct option *option, const char *text, void *values,
                     struct message *mistake) {
    void *value = (char *)values + option->offset;
    switch (option->kind) {
        case OPTION_FLAG:
            *(bool *)value = true;
            return OPTIONS_CONTINUE;
        case OPTION_TEXT:
            if (text[0] == '\0') {
                return message_set(mistake, CLIENT_USAGE, "--%s requires a non-empty %s",
                                   option->name, option->value_name);
            }
            *(const char **)value = text;
            return OPTIONS_CONTINUE;
        case OPTION_CHOICE:
            return set_choice(option, text, value, mistake);
        case OPTION_INT:
        case OPTION_REAL:
            break;
    }
    return set_numbers(option, text, value, mistake);
}

static int unknown_option(const struct option_page *page, const char *argument,
                          struct message *mistake) {
    const char *names[OPTIONS_NAMES_MAX];
    INVARIANT(page->option_count <= OPTIONS_NAMES_MAX);
    for (int i = 0; i < page->option_count; i++) {
        names[i] = page->options[i].name;
    }
    const char *bare = argument + strspn(argument, "-");
    const char *closest = options_closest(bare, names, page->option_count);
    if (closest != NULL) {
        return message_set(mistake, CLIENT_USAGE, "unknown option \"%s\"; did you mean --%s?",
                           argument, closest);
    }
    return message_set(mistake, CLIENT_USAGE, "unknown option \"%s\"", argument);
}

/// Parses the option at argv[*at] and its value, and leaves `*at` on the last argument used.
static int take_option(const struct option_page *page, int argc, char **argv, int *at, void *values,
                       struct message *mistake) {
    const char *argument = argv[*at];
    if (strncmp(argument, "--", 2) != 0) {
        return unknown_option(page, argument, mistake);
    }
    const char *name = argument + 2;
    const size_t length = strcspn(name, "=");
    const struct option *option = find_option(page, name, length);
    if (option == NULL) {
        return unknown_option(page, argument, mistake);
    }
    const bool attached = name[length] == '=';
    if (option->kind == OPTION_FLAG) {
        if (attached) {
            return message_set(mistake, CLIENT_USAGE, "--%s takes no value", option->name);
        }
        return set_value(option, NULL, values, mistake);
    }
    if (attached) {
        return set_value(option, name + length + 1, values, mistake);
    }
    if (*at + 1 >= argc) {
        return message_set(mistake, CLIENT_USAGE, "--%s requires a value: %s", option->name,
                           option->value_name);
    }
    (*at)++;
    return set_value(option, argv[*at], values, mistake);
}

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

static bool is_option(const char *argument) {
    return argument[0] == '-' && argument[1] != '\0';
}

int options_parse(const struct option_page *page, int argc, char **argv, void *values,
                  const char **operands, int *operand_count) {
    struct message mistake;
    int taken = 0;
    bool only_operands = false;
    if (find_help(page, argc, argv)) {
        return CLIENT_OK;
    }
    for (int i = 1; i < argc; i++) {
        if (!only_operands && strcmp(argv[i], "--") == 0) {
            only_operands = true;
        } else if (!only_operands && is_option(argv[i])) {
            if (take_option(page, argc, argv, &i, values, &mistake) != OPTIONS_CONTINUE) {
                return refuse(page, &mistake);
            }
        } else if (taken < page->operands_max) {
            operands[taken++] = argv[i];
        } else {
            message_set(&mistake, 0, "unexpected argument \"%s\" (expected %s)", argv[i],
                        page->operands_max > 0 ? page->operands : "no arguments");
            return refuse(page, &mistake);
        }
    }
    if (taken < page->operands_min) {
        message_set(&mistake, 0, "missing argument (expected %s)", page->operands);
        return refuse(page, &mistake);
    }
    *operand_count = taken;
    return OPTIONS_CONTINUE;
}
