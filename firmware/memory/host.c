// SPDX-License-Identifier: Apache-2.0
#include "memory/host.h"

#include <string.h>

#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "memory/calibration.h"

enum { RIG_COMMANDS_MAX = 32 };

static int give(const struct command_call *call, const char *line) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    size_t count = 0;
    const struct command *table = command_rig_table(&count);
    const int error = command_parse(line, table, count, storage, values, &command, call->message,
                                    call->message_bytes);
    INVARIANT(error == ERROR_OK && command != NULL);
    struct command_call inner = *call;
    inner.values = values;
    inner.line = line;
    inner.reply = NULL;
    return command_run(command, &inner);
}

static void read_state(const struct command_call *call, struct calibration_match_state *state) {
    const struct pair_instrument instrument = calibration_match_instrument(&call->rig->profile);
    calibration_match_now(call->rig, &instrument, state);
}

const struct command_host memory_host = {give, read_state, NULL};

static int run_zoom(const struct command_call *call) {
    const struct zoom_calibration *calibration = memory_calibration_zoom();
    if (!zoom_query_is_given(call->values)) {
        return commands_axis_zoom(call);
    }
    return calibration != NULL
               ? zoom_query_run(call, &memory_host, calibration)
               : command_refuse(call, ERROR_MISSING,
                                "zoom: this needs the calibration of all zooms (\"calibration set "
                                "FILE\" first)");
}

const struct command *memory_rig_table(size_t *count) {
    static struct command all[RIG_COMMANDS_MAX];
    const struct command *table = command_rig_table(count);
    INVARIANT(*count <= RIG_COMMANDS_MAX);
    memcpy(all, table, *count * sizeof *all);
    for (size_t i = 0; i < *count; i++) {
        if (strcmp(all[i].name, COMMANDS_ZOOM) == 0) {
            all[i].run = run_zoom;
        }
    }
    return all;
}
