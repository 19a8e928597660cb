// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/commands.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/commands.h"

enum { COMMANDS_MAX = 64 };

int command_fail(const struct command_call *call, int error, const char *format, ...) {
    INVARIANT(error < 0);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(call->message, call->message_bytes, format, arguments);
    va_end(arguments);
    for (char *at = call->message; *at != '\0'; at++) {
        *at = (unsigned char)*at < ' ' || *at == 0x7F ? '?' : *at;
    }
    return error;
}

int command_fail_store(const struct command_call *call, int error, const char *subject,
                       const char *action) {
    const char *why = error_text(error);
    if (error == ERROR_REFUSED) {
        why = "permission denied: check its owner, and whether its disk is read-only";
    } else if (error == ERROR_IO) {
        why =
            "its disk has failed, or the directory was removed: restore it and restart the daemon";
    }
    return command_fail(call, error, "%s: cannot %s the store %s: %s", subject, action,
                        daemon_of(call)->config.store, why);
}

int command_give(const struct command_call *call, const char *line,
                 const struct command_reply *reply) {
    struct daemon *daemon = daemon_of(call);
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    const int error = command_parse(line, daemon->table, daemon->table_count, storage, values,
                                    &command, call->message, call->message_bytes);
    INVARIANT(error == 0 && command != NULL);
    struct command_call inner = *call;
    inner.values = values;
    inner.reply = reply;
    return record_run(&daemon->record, command, &inner, line);
}

/// The rig's `status`, and the daemon's part of the state.
static int run_status(const struct command_call *call) {
    const int error = commands_state_status(call);
    if (error != 0) {
        return error;
    }
    commands_session_put_state(call);
    return commands_calibration_put_state(call);
}

static int by_name(const void *a, const void *b) {
    return strcmp(((const struct command *)a)->name, ((const struct command *)b)->name);
}

/// Adapts a rig's command to the daemon.
static void adapt(struct command *command) {
    if (strcmp(command->name, "status") == 0) {
        command->run = run_status;
    } else if (strcmp(command->name, COMMANDS_BRINGUP) == 0) {
        command->run = commands_settings_bringup;
        command->flags |= COMMAND_UNRECORDED;  // it gives the rig's, and others
    }
}

const struct command *commands_all(size_t *count) {
#define TABLE(name) commands_##name##_table,
    static const struct command *(*const tables[])(size_t *) = {COMMAND_MODULES(TABLE)
                                                                    command_rig_table};
#undef TABLE
    static struct command all[COMMANDS_MAX];
    *count = 0;
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++) {
        size_t more = 0;
        const struct command *table = tables[i](&more);
        INVARIANT(*count + more <= COMMANDS_MAX);
        memcpy(all + *count, table, more * sizeof *all);
        *count += more;
    }
    for (size_t i = 0; i < *count; i++) {
        adapt(&all[i]);
    }
    qsort(all, *count, sizeof *all, by_name);
    return all;
}
