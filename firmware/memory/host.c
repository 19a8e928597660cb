// SPDX-License-Identifier: Apache-2.0
#include "memory/host.h"

#include <string.h>

#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "memory/calibration.h"
#include "memory/pair.h"

enum { RIG_COMMANDS_MAX = 32 };

static int give_of(const struct command_call *call, const struct command_table *table,
                   const char *line, const struct command_reply *reply) {
    char storage[COMMAND_LINE_MAX + 1];
    struct command_value values[COMMAND_ARGUMENTS_MAX];
    const struct command *command = NULL;
    const int error = command_parse(line, table->rows, table->count, storage, values, &command,
                                    call->message, call->message_bytes);
    INVARIANT(error == ERROR_OK && command != NULL);
    struct command_call inner = *call;
    inner.values = values;
    inner.line = line;
    inner.reply = reply;
    return command_run(command, &inner);
}

int memory_host_give(const struct command_call *call, const char *line,
                     const struct command_reply *reply) {
    return give_of(call, &call->table, line, reply);
}

static int give(const struct command_call *call, const char *line) {
    struct command_table table;
    table.rows = command_rig_table(&table.count);
    return give_of(call, &table, line, NULL);
}

static void read_state(const struct command_call *call, struct calibration_match_state *state) {
    const struct pair_instrument instrument = calibration_match_instrument(&call->rig->profile);
    calibration_match_now(call->rig, &instrument, state);
}

static void compute(const struct command_call *call, size_t bytes,
                    void (*job)(void *cookie, struct arena *arena), void *cookie) {
    struct arena *arena = memory_pair_arena_rest();
    const size_t mark = arena_mark(arena);
    (void)call;
    (void)bytes;
    job(cookie, arena);
    arena_release(arena, mark);
}

bool memory_host_should_stop(const struct command_call *call) {
    const struct rig_observer *observer = &call->rig->observer;
    (void)rig_serve(call->rig);
    return observer->should_stop(observer->self);
}

static void serve(const struct command_call *call) {
    (void)memory_host_should_stop(call);
}

const struct command_host memory_host = {give, read_state, compute, serve};

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
