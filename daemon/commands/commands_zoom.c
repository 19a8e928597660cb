// SPDX-License-Identifier: Apache-2.0
// The rig's zoom, and by the saved calibration of all zooms. The commands of the rig that this
// gives are recorded; what takes its time is computed on the disk writer's thread.
#include <stdlib.h>

#include "daemon/commands/commands.h"

static int give(const struct command_call *call, const char *line) {
    return command_give_rig(call, line, NULL);
}

struct computation {
    void (*run)(void *cookie, struct arena *arena);
    void *cookie;
    size_t bytes;
};

static void run_job(void *cookie) {
    const struct computation *self = cookie;
    struct arena arena;
    void *memory = malloc(self->bytes);
    arena_init(&arena, memory, memory == NULL ? 0 : self->bytes);
    self->run(self->cookie, &arena);
    free(memory);
}

static void compute(const struct command_call *call, size_t bytes,
                    void (*run)(void *cookie, struct arena *arena), void *cookie) {
    struct computation job = {run, cookie, bytes};
    disk_writer_run(&daemon_of(call)->disk_writer, run_job, &job);
}

const struct command_host commands_host = {give, commands_calibration_now, compute, NULL};

int commands_zoom_run(const struct command_call *call) {
    struct zoom_calibration *calibration = NULL;
    bool accepted = false;
    if (!zoom_query_is_given(call->values)) {
        return command_give_rig(call, call->line, call->reply);
    }
    int error = commands_calibration_zoom(call, &calibration, &accepted);
    error = error == ERROR_OK ? zoom_query_run(call, &commands_host, calibration) : error;
    free(calibration);
    return error;
}
