// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/replay/replay_command.h"

#include <fcntl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/error.h"
#include "daemon/backends/replay/play.h"
#include "daemon/base/json.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "daemon/cli/progress.h"

struct arguments {
    bool json;
    bool quiet;
};

static const struct command_argument options[] = {
    {.name = "json",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, json),
     .help = "Print the result as JSON."},
    {.name = "quiet",
     .kind = COMMAND_FLAG,
     .offset = offsetof(struct arguments, quiet),
     .help = "Print no progress, and nothing if everything matches."},
};

static const struct option_page page = {
    .command = "vergence replay",
    .operands = "SESSION",
    .summary = "replay a recording and compare the pairs",
    .description =
        "Runs the commands of a recorded session (\"record\" at the instrument's console) on the "
        "recorded answers of the hardware. Every call and every pair must match bit for bit; "
        "otherwise the first difference is reported.\n"
        "Exit codes: 0 everything matches; 1 something differs; 3 no recording to replay.",
    .examples =
        "vergence replay record-20261122-101500\n"
        "vergence replay record-20261122-101500 --json",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
    .operands_min = 1,
    .operands_max = 1,
};

static bool should_stop(void *self) {
    (void)self;
    return interrupt_requested();
}

static void show_progress(void *self, const char *what, uint32_t done, uint32_t total) {
    progress_show(self, 0, what, (int)done, (int)total);
}

static void print_json(const char *path, const struct play_outcome *outcome) {
    struct json json;
    json_begin(&json, stdout);
    json_open_object(&json, NULL);
    json_text(&json, "session", path);
    json_text(&json, "build", outcome->build);
    json_text(&json, "profile", outcome->profile);
    json_integer(&json, "commands", outcome->commands);
    json_integer(&json, "calls", outcome->calls);
    json_integer(&json, "pairs", outcome->pairs);
    json_bool(&json, "cut_off", outcome->cut);
    json_bool(&json, "same", outcome->same);
    if (outcome->same) {
        json_null(&json, "difference");
    } else {
        json_open_object(&json, "difference");
        json_integer(&json, "command", outcome->command);
        json_integer(&json, "call", outcome->call);
        json_text(&json, "text", outcome->mismatch.text);
        json_close_object(&json);
    }
    json_close_object(&json);
    json_end(&json);
}

static void print_outcome(const char *path, const struct play_outcome *outcome,
                          const struct arguments *arguments) {
    if (arguments->json) {
        print_json(path, outcome);
    } else if (!arguments->quiet && outcome->same) {
        printf("%s: identical: %u commands, %u calls, %u pair%s%s\n", path,
               (unsigned)outcome->commands, (unsigned)outcome->calls, (unsigned)outcome->pairs,
               outcome->pairs == 1 ? "" : "s",
               outcome->cut ? "; the recording was cut off there" : "");
    }
    if (!outcome->same) {
        fprintf(stderr, "vergence replay: command %u, call %u: %s\n", (unsigned)outcome->command,
                (unsigned)outcome->call, outcome->mismatch.text);
    }
}

int replay_command_run(int argc, char **argv) {
    struct arguments arguments = {.json = false};
    const char *path = NULL;
    int count = 0;
    struct play_outcome outcome;
    struct message message;
    struct progress progress;
    const double work = 1;
    const int exit_code = options_parse(&page, argc, argv, &arguments, &path, &count);
    if (exit_code != OPTIONS_CONTINUE) {
        return exit_code;
    }
    interrupt_catch();
    progress_begin(&progress, arguments.quiet);
    progress_expect(&progress, &work, 1);
    const struct play_observer observer = {should_stop, show_progress, &progress};
    const int error = play_session(AT_FDCWD, path, &observer, &outcome, &message);
    progress_end(&progress);
    if (error != ERROR_OK) {
        fprintf(stderr, "vergence replay: %s\n", message.text);
        return options_exit_code(error);
    }
    print_outcome(path, &outcome, &arguments);
    return outcome.same ? CLIENT_OK : CLIENT_FAILED;
}
