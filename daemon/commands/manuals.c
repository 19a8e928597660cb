// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/manuals.h"

#include <string.h>

#include "console/command_text.h"
#include "daemon/cli/help.h"
#include "daemon/settings/config.h"
#include "daemon/settings/config_keys.h"

enum { LIMITS_BYTES = 256 };

void manuals_print_config(FILE *file) {
    struct config defaults;
    char value[CONFIG_TEXT_BYTES + 16];
    char help[CONFIG_HELP_BYTES];
    size_t count = 0;
    const struct config_key *keys = config_keys(&count);
    bool of_rig = false;
    config_defaults(&defaults);
    manual_begin(file, "vergenced.conf", 5, "settings of vergenced");
    manual_heading(file, "DESCRIPTION");
    manual_text(file, config_summary);
    manual_heading(file, "SETTINGS");
    for (size_t i = 0; i < count; i++) {
        if (config_key_is_of_rig(i) && !of_rig) {
            manual_heading(file, "SETTINGS OF THE INSTRUMENT");
            manual_text(file, config_rig_summary);
            of_rig = true;
        }
        config_key_print(&defaults, i, value, sizeof value);
        config_key_describe(&keys[i], help, sizeof help);
        manual_entry(file, keys[i].name, value);
        manual_text(file, help);
    }
    manual_heading(file, "SEE ALSO");
    manual_reference(file, "", "vergenced", 8, true);
}

static void print_argument(FILE *file, const struct command_argument *argument) {
    char limits[LIMITS_BYTES];
    struct command_text text = command_text_begin(limits, sizeof limits);
    command_text_add(&text, "(");
    command_expected(argument, &text);
    command_text_add(&text, argument->optional ? "; optional)" : ")");
    manual_entry(file, argument->name, NULL);
    manual_text(file, argument->help);
    manual_text(file, limits);
}

void manuals_print_console(FILE *file, const struct command *table, size_t count) {
    char usage[COMMAND_USAGE_BYTES];
    manual_begin(file, "vergence-console", 7, "commands of an instrument");
    manual_heading(file, "DESCRIPTION");
    manual_text(file, "The output of \"help\" and \"help COMMAND\" at the console of vergenced.");
    manual_heading(file, "COMMANDS");
    for (size_t i = 0; i < count; i++) {
        const struct command *command = &table[i];
        command_usage(command, usage, sizeof usage);
        manual_subheading(file, usage);
        manual_text(file, command->summary);
        if (command->help[0] != '\0') {
            manual_paragraph(file, command->help);
        }
        for (unsigned j = 0; j < command->argument_count; j++) {
            print_argument(file, &command->arguments[j]);
        }
    }
    manual_heading(file, "SEE ALSO");
    manual_reference(file, "", "vergence-connect", 1, false);
    manual_reference(file, "", "vergenced", 8, true);
}

void manuals_print_completion(FILE *file, const struct command *table, size_t count) {
    static const char console[] = "vergence --connect WHERE";
    char place[COMMAND_LINE_MAX], word[COMMAND_CHOICE_MAX + 2];
    size_t key_count = 0;
    const struct config_key *keys = config_keys(&key_count);
    for (size_t i = 0; i < key_count; i++) {
        snprintf(place, sizeof place, "%s=", keys[i].name);
        shell_completion_add(file, "vergenced", place);
        if (keys[i].choices != NULL) {
            shell_completion_print(file, "vergenced", keys[i].name, keys[i].choices);
        }
    }
    for (size_t i = 0; i < count; i++) {
        shell_completion_add(file, console, table[i].name);
        unsigned operands = 0;
        for (unsigned j = 0; j < table[i].argument_count; j++) {
            const struct command_argument *argument = &table[i].arguments[j];
            const bool option = command_argument_is_option(argument);
            operands += !option;
            if (option) {
                snprintf(place, sizeof place, "%s %s", console, table[i].name);
                snprintf(word, sizeof word, "%s=", argument->name);
                shell_completion_add(file, place, word);
                if (argument->kind == COMMAND_FLAG || argument->kind == COMMAND_CHOICE) {
                    shell_completion_print(
                        file, place, argument->name,
                        argument->kind == COMMAND_FLAG ? "yes" : argument->choices);
                }
            } else if (argument->kind == COMMAND_CHOICE) {
                snprintf(place, sizeof place, "%s %u", table[i].name, operands);
                shell_completion_print(file, console, place, argument->choices);
            }
        }
    }
}
