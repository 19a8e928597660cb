// SPDX-License-Identifier: Apache-2.0
// The console's `replay`: replays a recording below "files" without touching the instrument.

#include <stdint.h>

#include "daemon/backends/replay/play.h"
#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"

static bool should_stop(void *call) {
    return daemon_should_stop(call);
}

static void show_progress(void *call, const char *what, uint32_t done, uint32_t total) {
    daemon_progress(call, what, done, total);
}

static int run_replay(const struct command_call *call) {
    struct command_call own = *call;
    const struct play_observer observer = {should_stop, show_progress, &own};
    const char *name = call->values[0].text;
    struct play_outcome outcome;
    struct message message;
    int error = files_need_directory(call);
    error = error != ERROR_OK ? error : files_check_plain(call, name);
    if (error != ERROR_OK) {
        return error;
    }
    error = play_session(daemon_of(call)->files_fd, name, &observer, &outcome, &message);
    if (error != ERROR_OK) {
        return command_fail(call, error, "%s", message.text);
    }
    reply_text(call, "session", name);
    reply_text(call, "build", outcome.build);
    reply_number(call, "commands", outcome.commands, 0, NULL);
    reply_number(call, "calls", outcome.calls, 0, NULL);
    reply_number(call, "pairs", outcome.pairs, 0, NULL);
    reply_text(call, "cut_off", outcome.cut ? "yes" : "no");
    reply_text(call, "same", outcome.same ? "yes" : "no");
    if (outcome.same) {
        return ERROR_OK;
    }
    reply_number(call, "command", outcome.command, 0, NULL);
    reply_number(call, "call", outcome.call, 0, NULL);
    return command_fail(call, ERROR_VERIFY, "%s", outcome.mismatch.text);
}

static const struct command_argument replay_arguments[] = {
    {.name = "SESSION",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .help = "a session recorded with \"record\"",
     .candidates = files_candidates_session},
};

static const struct command commands[] = {
    {.name = "replay",
     .summary = "replay a recording and compare the pairs",
     .help = "Runs its commands on the recorded answers of the hardware, without touching the "
             "instrument. Every pair must match bit for bit; otherwise the first difference is "
             "reported, with the number of the command and of the call.",
     .arguments = replay_arguments,
     .argument_count = 1,
     .flags = COMMAND_NO_RIG | COMMAND_LONG | COMMAND_GROUP_MEASURE,
     .run = run_replay},
};

const struct command *commands_replay_table(size_t *count) {
    *count = 1;
    return commands;
}
