// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/options_help.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/invariant.h"

enum { HELP_COLUMNS = 80, HELP_INDENT = 4, HELP_TEXT_INDENT = 8 };

void options_help_print_wrapped(FILE *file, int indent, const char *text) {
    int column = 0;
    while (*text != '\0') {
        const int length = (int)strcspn(text, " \n");
        if (column > 0 && column + 1 + length > HELP_COLUMNS) {
            fputc('\n', file);
            column = 0;
        }
        if (column == 0) {
            fprintf(file, "%*s", indent, "");
            column = indent;
        } else {
            fputc(' ', file);
            column++;
        }
        fwrite(text, 1, (size_t)length, file);
        column += length;
        text += length;
        if (*text == '\n') {
            fputs("\n\n", file);
            column = 0;
        }
        text += *text != '\0';
    }
    fputc('\n', file);
}

void options_help_limits(const struct command_argument *option, char *text, size_t bytes) {
    const bool number = option->kind == COMMAND_INTEGER || option->kind == COMMAND_NUMBER;
    struct command_text limits = command_text_begin(text, bytes);
    if (option->kind == COMMAND_CHOICE || (number && isfinite(option->max))) {
        command_text_add(&limits, "(");
        command_expected(option, &limits);
        command_text_add(&limits, ")");
    }
}

void options_help_usage(const struct option_page *page, char *text, size_t bytes) {
    const int length = snprintf(
        text, bytes, "%s%s%s%s", page->command, page->operands[0] != '\0' ? " " : "",
        page->operands,
        page->option_count > 0 && strstr(page->operands, "[OPTIONS]") == NULL ? " [OPTIONS]" : "");
    INVARIANT(length >= 0 && (size_t)length < bytes);
}

/// Prints lines unchanged, as a wrapped example cannot be copied.
static void print_indented(const char *text, FILE *file) {
    while (*text != '\0') {
        const int length = (int)strcspn(text, "\n");
        fprintf(file, "%*s%.*s\n", HELP_INDENT, "", length, text);
        text += length + (text[length] != '\0');
    }
}

void options_help_print(const struct option_page *page, FILE *file) {
    char text[OPTIONS_HELP_TEXT_BYTES];
    options_help_usage(page, text, sizeof text);
    fprintf(file, "%s - %s\n\nusage: %s\n\n", page->command, page->summary, text);
    options_help_print_wrapped(file, 0, page->description);
    fputs("\nOptions\n", file);
    for (unsigned i = 0; i < page->option_count; i++) {
        const struct command_argument *option = &page->options[i];
        fprintf(file, "%*s--%s%s%s\n", HELP_INDENT, "", option->name,
                option->value_name != NULL ? " " : "",
                option->value_name != NULL ? option->value_name : "");
        options_help_print_wrapped(file, HELP_TEXT_INDENT, option->help);
        options_help_limits(option, text, sizeof text);
        if (text[0] != '\0') {
            fprintf(file, "%*s%s\n", HELP_TEXT_INDENT, "", text);
        }
    }
    fprintf(file, "%*s--help\n%*sPrint this page.\n", HELP_INDENT, "", HELP_TEXT_INDENT, "");
    if (page->examples != NULL) {
        fputs("\nExamples\n", file);
        print_indented(page->examples, file);
    }
}
