// SPDX-License-Identifier: Apache-2.0
#include "daemon/surface/reconstruct_debug.h"

#include "core/error.h"
#include "core/invariant.h"

int reconstruct_debug_begin(struct reconstruct_debug *debug,
                            const struct reconstruct_debug_maker *maker,
                            const struct reconstruct_request *request,
                            const struct rectify_plan *plan, struct reconstruct_options *options,
                            struct message *message) {
    if (request->debug_path == NULL) {
        return ERROR_OK;
    }
    INVARIANT(maker != NULL && maker->file_count > 0);
    const int row = request->debug_row >= 0 ? request->debug_row : plan->height_px / 2;
    if (row >= plan->height_px) {
        return message_set(message, ERROR_ARGUMENT,
                           "--debug-row: no row %d (the rectified left image has 0 to %d)", row,
                           plan->height_px - 1);
    }
    const int error = atomic_dir_begin(&debug->directory, request->debug_path, maker->file_names,
                                       maker->file_count, message);
    if (error != ERROR_OK) {
        // Failing to write is a failure, not bad input.
        return error == ERROR_ARGUMENT ? ERROR_BUFFER : error;
    }
    debug->maker = maker;
    debug->self = maker->begin(options, row);
    return debug->self != NULL ? ERROR_OK
                               : message_set(message, ERROR_MEMORY, "out of memory for --debug");
}

int reconstruct_debug_finish(struct reconstruct_debug *debug,
                             const struct reconstruct_context *context, struct message *message) {
    const struct reconstruct_debug_maker *maker = debug->maker;
    if (maker == NULL) {
        return ERROR_OK;
    }
    const int error = maker->write(debug->self, context, &debug->directory, message);
    if (error != ERROR_OK) {
        atomic_dir_name_final(&debug->directory, message);
        return error;
    }
    return atomic_dir_commit(&debug->directory, maker->file_names, maker->file_count,
                             maker->file_names[maker->file_count - 1], message);
}

void reconstruct_debug_end(struct reconstruct_debug *debug) {
    atomic_dir_abort(&debug->directory);
    if (debug->self != NULL) {
        debug->maker->end(debug->self);
        debug->self = NULL;
    }
}
