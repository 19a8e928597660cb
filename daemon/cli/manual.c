// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/manual.h"

#include <ctype.h>
#include <string.h>

#include "core/invariant.h"
#include "daemon/base/process.h"
#include "daemon/cli/options_help.h"

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

void manual_reference(FILE *file, const char *before, const char *name, int section, bool last) {
    fputs(".BR ", file);
    put_escaped(file, before, strlen(before));
    put_escaped(file, name, strlen(name));
    fprintf(file, " (%d)%s\n", section, last ? "" : ",");
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
