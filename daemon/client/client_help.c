// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/client_help.h"

#include "daemon/cli/manual.h"
#include "daemon/cli/shell_completion.h"

static const char summary[] = "measures 3D surfaces with two cameras";

static const char *const usages[] = {
    "COMMAND [ARGUMENTS]",
    "help COMMAND",
    "--connect [ADDRESS] [COMMAND]   (an instrument; \"vergence help " CLIENT_HELP_CONNECT "\")",
    "--version",
};

static const struct {
    const char *code, *meaning;
} exits[] = {
    {"0", "success"},
    {"1", "failed: results could not be written, or out of memory"},
    {"2", "invalid command line"},
    {"3", "bad input: an image, a calibration or another file is unusable"},
    {"4", "no surface: the inputs are fine but nothing could be measured"},
    {"5", "not good: a calibration was written, but it is marked as not good"},
    {"130", "interrupted (Ctrl-C); 143 terminated, 129 hung up"},
};

static const char exits_note[] =
    "All but 0 come with one line on standard error that gives the reason.";

enum {
    USAGE_COUNT = sizeof usages / sizeof usages[0],
    EXIT_COUNT = sizeof exits / sizeof exits[0],
};

void client_help_print(FILE *file, const struct client_command *commands, int command_count) {
    fprintf(file, "vergence - %s\n\n", summary);
    for (int i = 0; i < USAGE_COUNT; i++) {
        fprintf(file, "%s vergence %s\n", i == 0 ? "usage:" : "      ", usages[i]);
    }
    fputs("\nCommands\n", file);
    for (int i = 0; i < command_count; i++) {
        fprintf(file, "  %-14s%s\n", commands[i].name, commands[i].summary);
    }
    fputs("\nExit codes\n", file);
    for (int i = 0; i < EXIT_COUNT; i++) {
        fprintf(file, "  %-5s%s\n", exits[i].code, exits[i].meaning);
    }
    fprintf(file, "%s\n", exits_note);
}

void client_help_print_manual(FILE *file, const struct client_command *commands,
                              int command_count) {
    manual_begin(file, "vergence", 1, summary);
    manual_heading(file, "SYNOPSIS");
    for (int i = 0; i < USAGE_COUNT; i++) {
        manual_synopsis(file, "vergence", usages[i], i > 0);
    }
    manual_heading(file, "COMMANDS");
    for (int i = 0; i < command_count; i++) {
        manual_entry(file, commands[i].name, NULL);
        manual_text(file, commands[i].summary);
    }
    manual_heading(file, "EXIT STATUS");
    for (int i = 0; i < EXIT_COUNT; i++) {
        manual_entry(file, exits[i].code, NULL);
        manual_text(file, exits[i].meaning);
    }
    manual_paragraph(file, exits_note);
    manual_heading(file, "SEE ALSO");
    for (int i = 0; i < command_count; i++) {
        manual_reference(file, "vergence-", commands[i].name, 1, false);
    }
    manual_reference(file, "vergence-", CLIENT_HELP_CONNECT, 1, false);
    manual_reference(file, "", "vergenced", 8, true);
}

void client_help_print_names(FILE *file, const struct client_command *commands, int command_count) {
    for (int i = 0; i < command_count; i++) {
        fprintf(file, "%s\n", commands[i].name);
    }
    fputs(CLIENT_HELP_CONNECT "\n", file);
}

void client_help_print_completion(FILE *file, const struct client_command *commands,
                                  int command_count) {
    for (int i = 0; i < command_count; i++) {
        shell_completion_add(file, "vergence", commands[i].name);
        shell_completion_add(file, "vergence help", commands[i].name);
    }
    shell_completion_add(file, "vergence help", CLIENT_HELP_CONNECT);
    shell_completion_add(file, "vergence", "help --connect --help --version");
}
