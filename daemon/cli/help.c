// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/help.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "core/invariant.h"
#include "daemon/base/process.h"

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

// ---- manual pages

enum { MANUAL_COLUMNS = 78, NAME_BYTES = 64 };

/// roff's form of a character that would otherwise be interpreted or printed differently; NULL: the
/// character itself.
static const char *escape_of(char character) {
    static const struct {
        char character;
        const char *escape;
    } escapes[] = {{'\\', "\\e"},  {'-', "\\-"},   {'\'', "\\(aq"}, {'`', "\\(ga"},
                   {'^', "\\(ha"}, {'~', "\\(ti"}, {'"', "\\(dq"}};
    for (size_t i = 0; i < sizeof escapes / sizeof escapes[0]; i++) {
        if (escapes[i].character == character) {
            return escapes[i].escape;
        }
    }
    return NULL;
}

static size_t escaped_length(const char *text, size_t length) {
    size_t sum = 0;
    for (size_t i = 0; i < length; i++) {
        const char *escape = escape_of(text[i]);
        sum += escape != NULL ? strlen(escape) : 1;
    }
    return sum;
}

static void put_escaped(FILE *file, const char *text, size_t length) {
    for (size_t i = 0; i < length; i++) {
        const char *escape = escape_of(text[i]);
        if (escape != NULL) {
            fputs(escape, file);
        } else {
            fputc(text[i], file);
        }
    }
}

/// The same at the start of a line, where a full stop would begin a request.
static void put_line_begin(FILE *file, const char *text, size_t length) {
    if (length > 0 && text[0] == '.') {
        fputs("\\&", file);
    }
    put_escaped(file, text, length);
}

void manual_begin(FILE *file, const char *name, int section, const char *summary) {
    fputs(".\\\" SPDX-License-Identifier: Apache-2.0\n.TH ", file);
    for (const char *at = name; *at != '\0'; at++) {
        fputc(toupper((unsigned char)*at), file);
    }
    fprintf(file, " %d \"%s\" \"Vergence %s\" \"Vergence\"\n.SH NAME\n", section,
            version_build_date(), version_text());
    put_line_begin(file, name, strlen(name));
    fputs(" \\- ", file);
    put_escaped(file, summary, strlen(summary));
    fputc('\n', file);
}

void manual_heading(FILE *file, const char *title) {
    fprintf(file, ".SH %s\n", title);
}

void manual_subheading(FILE *file, const char *title) {
    fputs(".SS ", file);
    put_escaped(file, title, strlen(title));
    fputc('\n', file);
}

void manual_text(FILE *file, const char *text) {
    size_t column = 0;
    while (*text != '\0') {
        const size_t length = strcspn(text, " \n");
        const size_t width = escaped_length(text, length);
        if (column > 0 && column + 1 + width > MANUAL_COLUMNS) {
            fputc('\n', file);
            column = 0;
        }
        if (column > 0) {
            fputc(' ', file);
            put_escaped(file, text, length);
        } else {
            put_line_begin(file, text, length);
        }
        column += width + 1;
        text += length;
        if (*text == '\n') {
            fputs("\n.PP\n", file);
            column = 0;
        }
        text += strspn(text, " \n");
    }
    fputs(column > 0 ? "\n" : "", file);
}

void manual_lines(FILE *file, const char *text) {
    fputs(".nf\n", file);
    while (*text != '\0') {
        const size_t length = strcspn(text, "\n");
        put_line_begin(file, text, length);
        fputc('\n', file);
        text += length + (text[length] != '\0');
    }
    fputs(".fi\n", file);
}

void manual_entry(FILE *file, const char *name, const char *value) {
    fputs(".TP\n\\fB", file);
    put_escaped(file, name, strlen(name));
    fputs("\\fR", file);
    if (value != NULL) {
        fputs(" \\fI", file);
        put_escaped(file, value, strlen(value));
        fputs("\\fR", file);
    }
    fputc('\n', file);
}

void manual_paragraph(FILE *file, const char *text) {
    fputs(".PP\n", file);
    manual_text(file, text);
}

void manual_synopsis(FILE *file, const char *command, const char *operands, bool more) {
    fprintf(file, "%s\\fB", more ? ".PP\n" : "");
    put_escaped(file, command, strlen(command));
    fputs("\\fR\n", file);
    manual_text(file, operands + strspn(operands, " "));
}

/// The page of "vergence reconstruct" is vergence-reconstruct, of "vergence --connect"
/// vergence-connect.
static void name_of(const char *command, char name[NAME_BYTES]) {
    size_t length = 0;
    for (const char *at = command; *at != '\0'; at++) {
        const bool joined = *at == '-' && length > 0 && name[length - 1] == '-';
        INVARIANT(length + 1 < NAME_BYTES);
        if (!joined) {
            name[length++] = *at == ' ' ? '-' : *at;
        }
    }
    name[length] = '\0';
}

void manual_reference(FILE *file, const char *before, const char *name, int section, bool last) {
    char page[NAME_BYTES];
    name_of(name, page);
    fputs(".BR ", file);
    put_escaped(file, before, strlen(before));
    put_escaped(file, page, strlen(page));
    fprintf(file, " (%d)%s\n", section, last ? "" : ",");
}

void manual_options(FILE *file, const struct option_page *page, int section) {
    char name[NAME_BYTES];
    char limits[OPTIONS_HELP_TEXT_BYTES];
    char dashed[NAME_BYTES + 2];
    char usage[OPTIONS_HELP_TEXT_BYTES];
    name_of(page->command, name);
    options_help_usage(page, usage, sizeof usage);
    manual_begin(file, name, section, page->summary);
    manual_heading(file, "SYNOPSIS");
    manual_synopsis(file, page->command, usage + strlen(page->command), false);
    manual_heading(file, "DESCRIPTION");
    manual_text(file, page->description);
    manual_heading(file, "OPTIONS");
    for (unsigned i = 0; i < page->option_count; i++) {
        const struct command_argument *option = &page->options[i];
        snprintf(dashed, sizeof dashed, "--%s", option->name);
        manual_entry(file, dashed, option->value_name);
        manual_text(file, option->help);
        options_help_limits(option, limits, sizeof limits);
        manual_text(file, limits);
    }
    manual_entry(file, "--help", NULL);
    manual_text(file, "Print this page.");
    if (page->examples != NULL) {
        manual_heading(file, "EXAMPLES");
        manual_lines(file, page->examples);
    }
}

// ---- shell completion

void shell_completion_print(FILE *file, const char *key, const char *part, const char *words) {
    INVARIANT(strchr(key, '\'') == NULL && strchr(words, '\'') == NULL);
    fprintf(file, "_vergence_words['%s%s%s']='%s'\n", key, part != NULL ? " " : "",
            part != NULL ? part : "", words);
}

void shell_completion_add(FILE *file, const char *key, const char *word) {
    INVARIANT(strchr(key, '\'') == NULL && strchr(word, '\'') == NULL);
    fprintf(file, "_vergence_words['%s']+=' %s'\n", key, word);
}

static const char *completions_of(const struct command_argument *option) {
    if (option->kind == COMMAND_CHOICE) {
        return option->choices;
    }
    // An instrument is completed with the addresses known on this machine.
    return strcmp(option->name, "connect") == 0 ? "@addresses" : "";
}

void shell_completion_options(FILE *file, const struct option_page *page) {
    char dashed[64];
    for (unsigned i = 0; i < page->option_count; i++) {
        const struct command_argument *option = &page->options[i];
        const int length = snprintf(dashed, sizeof dashed, "--%s", option->name);
        INVARIANT(length > 0 && (size_t)length < sizeof dashed);
        shell_completion_add(file, page->command, dashed);
        if (option->kind == COMMAND_FLAG) {
            continue;
        }
        shell_completion_print(file, page->command, dashed, completions_of(option));
    }
    shell_completion_add(file, page->command, "--help");
}
