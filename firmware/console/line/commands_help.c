// SPDX-License-Identifier: Apache-2.0
#include "console/line/commands_help.h"

#include "console/command_text.h"
#include "console/line/completion.h"
#include "console/line/editor.h"
#include "core/error.h"

static void describe_argument(const struct command_call *call,
                              const struct command_argument *argument) {
    reply_group_begin(call, argument->name, false);
    reply_text(call, "meaning", argument->help);
    char expected[160];
    struct command_text text = command_text_begin(expected, sizeof expected);
    command_expected(argument, &text);
    reply_text(call, "expected", expected);
    if (argument->optional || command_argument_is_option(argument)) {
        reply_text(call, "optional", "yes");
    }
    reply_group_end(call);
}

static const struct {
    const char *name;
    unsigned flags;
} help_groups[] = {{"look", COMMAND_GROUP_LOOK},   {"move", COMMAND_GROUP_MOVE},
                   {"light", COMMAND_GROUP_LIGHT}, {"measure", COMMAND_GROUP_MEASURE},
                   {"files", COMMAND_GROUP_FILES}, {"service", COMMAND_GROUP_SERVICE}};

/// Lists the commands that have these of the flags in the mask.
static void list_group(const struct command_call *call, const char *name, unsigned mask,
                       unsigned flags) {
    reply_group_begin(call, name, false);
    for (size_t i = 0; i < call->table.count; i++) {
        if ((call->table.rows[i].flags & mask) == flags) {
            reply_text(call, call->table.rows[i].name, call->table.rows[i].summary);
        }
    }
    reply_group_end(call);
}

static int run_help(const struct command_call *call) {
    if (!call->values[0].given) {
        list_group(call, "daily", COMMAND_DAILY, COMMAND_DAILY);
        for (size_t i = 0; i < sizeof help_groups / sizeof help_groups[0]; i++) {
            list_group(call, help_groups[i].name, COMMAND_GROUPS | COMMAND_DAILY,
                       help_groups[i].flags);
        }
        return 0;
    }
    const char *name = call->values[0].text;
    const struct command *command = command_find(call->table.rows, call->table.count, name);
    if (command == NULL) {
        struct command_text message = command_text_begin(call->message, call->message_bytes);
        return command_unknown(call->table.rows, call->table.count, name, &message);
    }
    char usage[COMMAND_USAGE_BYTES];
    command_usage(command, usage, sizeof usage);
    reply_text(call, "usage", usage);
    reply_text(call, "does", command->summary);
    for (unsigned i = 0; i < command->argument_count; i++) {
        describe_argument(call, &command->arguments[i]);
    }
    if (command->help[0] != '\0') {
        reply_text(call, "more", command->help);
    }
    return 0;
}

static int run_complete(const struct command_call *call) {
    char words[EDITOR_WORDS_BYTES];
    completion_words(&call->table, call->context, call->values[0].text, words, sizeof words);
    if (words[0] != '\0') {
        reply_text(call, "words", words);
    }
    return ERROR_OK;
}

void commands_help_candidates(const struct command_candidates *to) {
    for (size_t i = 0; i < to->table.count; i++) {
        to->add(to->self, to->table.rows[i].name);
    }
}

static const struct command_argument help_arguments[] = {
    {.name = "COMMAND",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = 32,
     .optional = true,
     .help = "the command to explain; default: list all",
     .candidates = commands_help_candidates},
};

static const struct command_argument complete_arguments[] = {
    {.name = "LINE",
     .kind = COMMAND_TEXT,
     .min = 0,
     .max = 400,
     .help = "the line as typed so far, in quotes"},
};

const struct command *command_help_table(size_t *count) {
    static const struct command commands[] = {
        {.name = "help",
         .summary = "list the commands, or explain one",
         .help =
             "Arguments in brackets are optional; those with = are options, given by name in any "
             "order: reconstruct scene near=500 far=2000. Numbers may have a unit of their kind: "
             "focus 1.8 m, near=50cm, exposure 10 ms, exposure 1/100, zoom 5x, iris f/8. An answer "
             "ends with OK, or with ERR, an error code and a message. Ctrl-C cancels the running "
             "command.",
         .arguments = help_arguments,
         .argument_count = 1,
         .flags = COMMAND_NO_RIG,
         .run = run_help},
        {.name = "complete",
         .summary = "list possible continuations of a line, as Tab does",
         .help = "For terminals. A word that ends in / or = is incomplete.",
         .arguments = complete_arguments,
         .argument_count = 1,
         .flags = COMMAND_NO_RIG,
         .run = run_complete},
    };
    *count = sizeof commands / sizeof commands[0];
    return commands;
}
