// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands/commands.h"

#include <stdlib.h>
#include <string.h>

#include "console/commands.h"
#include "console/line/commands_help.h"

enum { COMMANDS_MAX = 64 };

/// The rig's `status`, and the daemon's part of the state.
static int run_status(const struct command_call *call) {
    const int error = commands_state_status(call);
    if (error != ERROR_OK) {
        return error;
    }
    commands_session_put_state(call);
    commands_calibration_put_state(call);
    return ERROR_OK;
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
    } else if (strcmp(command->name, COMMANDS_ZOOM) == 0) {
        command->run = commands_zoom_run;
        command->flags |= COMMAND_UNRECORDED;
    }
}

struct command_table commands_all(void) {
#define TABLE(name) commands_##name##_table,
    static const struct command *(*const tables[])(size_t *) = {
        COMMAND_MODULES(TABLE) command_help_table, command_rig_table};
#undef TABLE
    static struct command all[COMMANDS_MAX];
    const struct command_table table =
        command_join(tables, sizeof tables / sizeof tables[0], all, COMMANDS_MAX);
    for (size_t i = 0; i < table.count; i++) {
        adapt(&all[i]);
    }
    qsort(all, table.count, sizeof *all, by_name);
    return table;
}
