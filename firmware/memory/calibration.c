// SPDX-License-Identifier: Apache-2.0
#include "memory/calibration.h"

#include "console/command_text.h"
#include "console/line/file_blocks.h"
#include "console/pair/calibration_at.h"
#include "console/pair/calibration_reply.h"
#include "console/pair/capture.h"
#include "core/error.h"
#include "memory/files.h"
#include "memory/pair.h"

enum { SHOW, SET, FORGET };
enum { WHAT, FILE_NAME, ARGUMENTS };

enum kind { NONE, ONE_STATE, ALL_ZOOMS };

static const char record_name[] = "calibration";

static struct {
    enum kind kind;
    struct calibration one;
    struct zoom_calibration zoom;
    const struct hal_store *store;
} kept;

bool memory_calibration_is_set(void) {
    return kept.kind != NONE;
}

const struct zoom_calibration *memory_calibration_zoom(void) {
    return kept.kind == ALL_ZOOMS ? &kept.zoom : NULL;
}

int memory_calibration_for(const struct calibration_match_state *state,
                           struct calibration *calibration, struct message *message) {
    if (kept.kind == NONE) {
        return command_text_message(message, ERROR_MISSING,
                                    "no calibration is set (\"calibration set FILE\" first)");
    }
    if (kept.kind == ALL_ZOOMS) {
        const int error = calibration_at_zoom(&kept.zoom, state, calibration, message);
        if (error != ERROR_OK) {
            return error;
        }
    } else {
        *calibration = kept.one;
    }
    return calibration_match(calibration, state, CAPTURE_ACCEPT_WORD, message);
}

static void show(const struct command_call *call) {
    if (kept.kind == ALL_ZOOMS) {
        calibration_reply_put_zoom(call, &kept.zoom);
    } else {
        calibration_reply_put(call, &kept.one);
    }
}

static int set_one(const char *name, const char *text, size_t bytes, struct message *message) {
    struct calibration calibration;
    const int error = calibration_at(name, text, bytes, &calibration, message);
    if (error == ERROR_OK) {
        kept.one = calibration;
        kept.kind = ONE_STATE;
    }
    return error;
}

static int set_zoom(const char *name, const char *text, size_t bytes, const struct watch *watch,
                    struct arena *arena, struct message *message) {
    struct zoom_calibration *zoom = arena_take(arena, 1, sizeof *zoom);
    double *matrix = arena_take(arena, 1, CALIBRATION_AT_MATRIX_BYTES);
    if (zoom == NULL || matrix == NULL) {
        return command_text_message(message, ERROR_MEMORY,
                                    "no memory to check it (take a smaller pair first)");
    }
    const int error = calibration_at_parse_zoom(name, text, bytes, watch, matrix, zoom, message);
    if (error == ERROR_OK) {
        kept.zoom = *zoom;
        kept.kind = ALL_ZOOMS;
    }
    return error;
}

static int set_text(const char *name, const char *text, size_t bytes, const struct watch *watch,
                    struct arena *arena, struct message *message) {
    return zoom_calibration_is_text(text, bytes)
               ? set_zoom(name, text, bytes, watch, arena, message)
               : set_one(name, text, bytes, message);
}

void memory_calibration_begin(const struct hal_store *store) {
    struct arena *arena = memory_pair_arena();
    char *text = arena_take(arena, ZOOM_TEXT_MAX_BYTES, 1);
    struct message message;
    size_t bytes = 0;
    kept.store = store;
    if (text != NULL && store->operations->load(store->self, record_name, text, ZOOM_TEXT_MAX_BYTES,
                                                &bytes) == ERROR_OK) {
        // One that an earlier version wrote may be refused: then none is in force.
        (void)set_text(record_name, text, bytes, NULL, arena, &message);
    }
}

static void serve(void *cookie) {
    const struct rig_observer *observer = cookie;
    (void)observer->should_stop(observer->self);
}

/// Beside a surface if there is room, so that a file that is refused does not cost it.
static int set_sent(struct rig *rig, const char *name, const char *text, size_t bytes,
                    struct message *message) {
    const struct watch watch = {serve, &rig->observer};
    struct arena *rest = memory_pair_arena_rest();
    const size_t mark = arena_mark(rest);
    const int error = set_text(name, text, bytes, &watch, rest, message);
    arena_release(rest, mark);
    return error == ERROR_MEMORY ? set_text(name, text, bytes, &watch, memory_pair_arena(), message)
                                 : error;
}

static int set(const struct command_call *call) {
    struct message message;
    size_t bytes = 0;
    const char *name = call->values[FILE_NAME].text;
    const char *text = memory_files_sent(name, &bytes);
    const int error = text == NULL ? command_text_message(&message, ERROR_MISSING,
                                                          "%s: not here (\"send\" it first)", name)
                                   : set_sent(call->rig, name, text, bytes, &message);
    if (error != ERROR_OK) {
        return command_refuse(call, error, "%s", message.text);
    }
    const int kept_error = kept.store->operations->save(kept.store->self, record_name, text, bytes);
    if (kept_error != ERROR_OK) {
        return command_refuse(call, kept_error,
                              "calibration: in force until a restart, which it does not survive: "
                              "%s",
                              error_text(kept_error));
    }
    show(call);
    return ERROR_OK;
}

static int run_calibration(const struct command_call *call) {
    const int what = call->values[WHAT].given ? call->values[WHAT].choice : SHOW;
    if ((what == SET) != call->values[FILE_NAME].given) {
        return command_refuse(call, what == SET ? ERROR_MISSING : ERROR_ARGUMENT,
                              "calibration: \"set\" requires FILE, the others take none");
    }
    if (what == SET) {
        return set(call);
    }
    if (kept.kind == NONE) {
        return command_refuse(call, ERROR_MISSING,
                              "calibration: none is set (\"calibration set FILE\")");
    }
    if (what == SHOW) {
        show(call);
        return ERROR_OK;
    }
    kept.kind = NONE;
    const int error = kept.store->operations->remove(kept.store->self, record_name);
    return error == ERROR_MISSING ? ERROR_OK : error;
}

const struct command *memory_calibration_table(size_t *count) {
    static const struct command_argument arguments[ARGUMENTS] = {
        [WHAT] = {.name = "WHAT",
                  .kind = COMMAND_CHOICE,
                  .choices = "show set forget",
                  .optional = true,
                  .help = "what to do; default: show"},
        [FILE_NAME] = {.name = "FILE",
                       .kind = COMMAND_TEXT,
                       .min = 1,
                       .max = FILE_BLOCKS_SENT_NAME_MAX,
                       .optional = true,
                       .help = "calibration to set: the file that was sent last"},
    };
    static const struct command commands[] = {
        {.name = "calibration",
         .summary = "show, set or forget the calibration in force",
         .help = "It is that of all zooms, or of one state of the axes, of the whole sensor or of "
                 "the window, and survives a restart.",
         .arguments = arguments,
         .argument_count = ARGUMENTS,
         .flags = COMMAND_NO_RIG | COMMAND_GROUP_MEASURE,
         .run = run_calibration},
    };
    *count = 1;
    return commands;
}
