// SPDX-License-Identifier: Apache-2.0
// The saved calibration of the instrument: show, set from a file, forget.
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "daemon/commands/commands.h"
#include "daemon/commands/files.h"
#include "daemon/session/calibration_match.h"
#include "daemon/session/capture.h"
#include "daemon/surface/length_check.h"
#include "stereo/geometry/calibration.h"

enum { SHOW, SET, FORGET };
enum { WHAT, FILE_NAME, ACCEPT, UNIT, ARGUMENTS };

_Static_assert((int)STORE_CALIBRATION_BYTES == (int)CALIBRATION_TEXT_MAX_BYTES,
               "the buffers fit the longest calibration");

/// Reports cameras and axis positions with which it was made; unknown ones are omitted.
static void show_origin(const struct command_call *call, const struct calibration_origin *origin) {
    if (origin->instrument[0] != '\0') {
        reply_text(call, "instrument", origin->instrument);
    }
    for (int side = 0; side < RIG_SIDES; side++) {
        const struct calibration_side_origin *at = &origin->side[side];
        reply_group_begin(call, rig_side_names[side], false);
        if (at->camera[0] != '\0') {
            reply_text(call, "camera", at->camera);
        }
        for (int axis = 0; axis < CALIBRATION_AXES; axis++) {
            if (at->axis[axis].kind == CALIBRATION_AXIS_KNOWN) {
                reply_number(call, calibration_match_axis_name(axis), at->axis[axis].mean, 3,
                             calibration_match_axis_unit(axis));
            }
        }
        reply_group_end(call);
    }
}

static void show(const struct command_call *call, const struct calibration *calibration) {
    char crc[9];
    snprintf(crc, sizeof crc, "%08" PRIX32, calibration_crc(calibration));
    reply_text(call, "id", calibration->id);
    reply_text(call, "crc", crc);
    if (calibration->date[0] != '\0') {
        reply_text(call, "date", calibration->date);
    }
    reply_number(call, "baseline", calibration_baseline_mm(calibration), 3, "mm");
    if (calibration->depth_far_mm > 0) {
        reply_number(call, "depth_near", calibration->depth_near_mm, 1, "mm");
        reply_number(call, "depth_far", calibration->depth_far_mm, 1, "mm");
    }
    if (calibration->rms_px > 0) {
        reply_number(call, "rms", calibration->rms_px, 3, "px");
    }
    if (calibration->has_origin) {
        show_origin(call, &calibration->origin);
    }
}

// ---- the record

/// The text of a calibration; one more byte detects a longer file.
struct calibration_text {
    char data[CALIBRATION_TEXT_MAX_BYTES + 1];
    size_t length;
};

static int load_text(const struct command_call *call, struct calibration_text *text) {
    return commands_store_load(call, STORE_CALIBRATION, text->data, CALIBRATION_TEXT_MAX_BYTES,
                               &text->length);
}

/// A read of a file as a job for the disk writer.
struct reading {
    const struct command_call *call;
    const char *name;
    struct calibration_text text;
    int error;
};

static int read_text(struct reading *self) {
    const int fd = files_open(self->call, self->name);
    if (fd < 0) {
        return fd;
    }
    const ssize_t length = read(fd, self->text.data, sizeof self->text.data);
    close(fd);
    if (length < 0 || length > CALIBRATION_TEXT_MAX_BYTES) {
        return command_fail(self->call, ERROR_SYNTAX, "%s: not a calibration file of Vergence",
                            self->name);
    }
    self->text.length = (size_t)length;
    return 0;
}

static void read_job(void *cookie) {
    struct reading *self = cookie;
    self->error = read_text(self);
}

static int parse(const struct command_call *call, const char *name,
                 const struct calibration_text *text, struct calibration *calibration) {
    struct calibration_fault fault = {.field = "", .reason = ""};
    const int error = calibration_parse(text->data, text->length, calibration, &fault);
    if (error == 0) {
        return 0;
    }
    return command_fail(call, error, "%s:%d: %s%s%s%s%s", name, fault.line, fault.field,
                        fault.field[0] != '\0' ? ": " : "", error_text(error),
                        fault.reason[0] != '\0' ? ": " : "", fault.reason);
}

// ---- match with the instrument

void commands_calibration_instrument(const struct command_call *call,
                                     struct session_instrument *instrument) {
    const struct rig_devices *devices = call->rig->ports.devices;
    *instrument = calibration_match_instrument(&call->rig->profile);
    for (int side = 0; side < RIG_SIDES; side++) {
        const enum rig_part part = side == RIG_LEFT ? RIG_PART_LEFT_CAMERA : RIG_PART_RIGHT_CAMERA;
        const char *identity = devices != NULL && devices->identity != NULL
                                   ? devices->identity(devices->self, part)
                                   : NULL;
        snprintf(instrument->camera[side], sizeof instrument->camera[side], "%s",
                 identity != NULL ? identity : "");
    }
}

static int compare_with_saved(const struct command_call *call,
                              const struct calibration_match_state *state, const char *accept,
                              struct message *message) {
    struct calibration_text text;
    struct calibration calibration;
    message->text[0] = '\0';
    if (daemon_of(call)->store == NULL) {
        return 0;
    }
    int error = load_text(call, &text);
    if (error == ERROR_MISSING) {
        return 0;
    }
    if (error == 0) {
        error = calibration_parse(text.data, text.length, &calibration, NULL);
    }
    return error != 0 ? message_set(message, error, "the saved calibration cannot be read: %s",
                                    error_text(error))
                      : calibration_match(&calibration, state, accept, message);
}

int commands_calibration_check(const struct command_call *call, const struct pair *pair,
                               bool accepted) {
    struct calibration_match_state state;
    struct session_instrument instrument;
    struct message message;
    commands_calibration_instrument(call, &instrument);
    calibration_match_pair(call->rig->profile.name, &instrument, pair, &state);
    const int error =
        compare_with_saved(call, &state, accepted ? NULL : CAPTURE_ACCEPT_WORD, &message);
    if (error == ERROR_MISMATCH && accepted) {
        reply_text(call, "accepted_mismatch", message.text);
        return 0;
    }
    return error == 0 ? 0 : command_fail(call, error, "%s", message.text);
}

/// The state as a pair taken now would have it, with the positions last read.
static void state_now(const struct command_call *call, struct calibration_match_state *state) {
    const struct rig *rig = call->rig;
    struct session_instrument instrument;
    struct pair pair;
    memset(&pair, 0, sizeof pair);
    for (int side = 0; side < RIG_SIDES; side++) {
        struct pair_frame *frame = &pair.frame[side];
        frame->before.pan_q4 = rig->camera[side].pan_q4;
        memcpy(frame->before.lens, rig->camera[side].lens.measured, sizeof frame->before.lens);
        frame->after = frame->before;
        frame->image.width_px = rig->format.width_px;
        frame->image.height_px = rig->format.height_px;
        if (rig->profile.bridge && rig->state == RIG_READY) {
            const struct mt9t001_window *window = &rig->camera[side].sensor.window;
            frame->window = (struct pair_window){window->column_px, window->row_px, window->skip};
        }
    }
    commands_calibration_instrument(call, &instrument);
    calibration_match_pair(rig->profile.name, &instrument, &pair, state);
}

/// Reads the lens positions, which may have changed since they were last read. Not while recording:
/// these calls belong to a command that a recording does not contain.
static int read_lenses(const struct command_call *call) {
    int error = 0;
    for (unsigned side = 0; side < RIG_SIDES && error == 0; side++) {
        int32_t positions[LENS_AXES];
        if (call->rig->camera[side].lens.drive.controller != NULL &&
            !record_is_under_way(&daemon_of(call)->record)) {
            error = rig_lens_read(call->rig, side, positions);
        }
    }
    return error;
}

int commands_calibration_put_state(const struct command_call *call) {
    struct calibration_match_state state;
    struct calibration_text text;
    struct calibration calibration;
    struct message message;
    if (daemon_of(call)->store == NULL || load_text(call, &text) != 0 ||
        calibration_parse(text.data, text.length, &calibration, NULL) != 0) {
        return 0;  // the command "calibration" reports it
    }
    reply_group_begin(call, "calibration", false);
    reply_text(call, "id", calibration.id);
    int error = 0;
    if (call->rig->state == RIG_READY) {
        state_now(call, &state);
        error = calibration_match(&calibration, &state, CAPTURE_ACCEPT_WORD, &message);
        reply_text(call, "match",
                   error != 0                                                  ? "no"
                   : calibration_match_is_partial(&calibration, &state.origin) ? "not known"
                                                                               : "yes");
    }
    reply_group_end(call);
    return error == 0 ? 0 : command_fail(call, error, "%s", message.text);
}

// ---- the command

static int run_show(const struct command_call *call) {
    struct calibration_text text;
    struct calibration calibration;
    int error = load_text(call, &text);
    if (error == ERROR_MISSING) {
        return command_fail(call, error,
                            "calibration: none saved (\"calibration set FILE\" first)");
    }
    if (error != 0) {
        return command_fail_store(call, error, "calibration", "read from");
    }
    error = parse(call, STORE_CALIBRATION, &text, &calibration);
    if (error == 0) {
        show(call, &calibration);
    }
    return error;
}

/// Rejects a calibration of another instrument or of other axis positions, unless accepted.
static int check_match(const struct command_call *call, const struct calibration *calibration) {
    struct calibration_match_state state;
    struct message message;
    if (call->rig->state != RIG_READY || !calibration->has_origin) {
        return 0;
    }
    int error = read_lenses(call);
    if (error != 0) {
        return error;
    }
    state_now(call, &state);
    const bool accepted = command_is_set(&call->values[ACCEPT]);
    error = calibration_match(calibration, &state, accepted ? NULL : CAPTURE_ACCEPT_WORD, &message);
    if (error != 0 && accepted) {
        reply_text(call, "accepted_mismatch", message.text);
        return 0;
    }
    return error == 0 ? 0 : command_fail(call, error, "%s", message.text);
}

static int run_set(const struct command_call *call) {
    struct reading file = {.call = call, .name = call->values[FILE_NAME].text};
    struct calibration calibration;
    disk_writer_run(&daemon_of(call)->disk_writer, read_job, &file);
    int error = file.error;
    error = error != 0 ? error : parse(call, file.name, &file.text, &calibration);
    error = error != 0 ? error : check_match(call, &calibration);
    if (error != 0) {
        return error;
    }
    struct message message;
    if (!call->values[UNIT].given &&
        length_check_baseline(calibration_baseline_mm(&calibration), file.name,
                              "\"calibration set FILE unit=mm\" accepts it", &message) != 0) {
        return command_fail(call, ERROR_BASELINE, "%s", message.text);
    }
    error = commands_store_save(call, STORE_CALIBRATION, file.text.data, file.text.length);
    if (error != 0) {
        return command_fail_store(call, error, "calibration", "save to");
    }
    show(call, &calibration);
    return 0;
}

static int run_forget(const struct command_call *call) {
    const int error = commands_store_remove(call, STORE_CALIBRATION);
    if (error == ERROR_MISSING) {
        return command_fail(call, error, "calibration: none saved");
    }
    return error == 0 ? 0 : command_fail_store(call, error, "calibration", "remove from");
}

static int run_calibration(const struct command_call *call) {
    const struct hal_store *store = daemon_of(call)->store;
    const int what = call->values[WHAT].given ? call->values[WHAT].choice : SHOW;
    if (store == NULL) {
        return command_fail(call, ERROR_UNSUPPORTED,
                            "calibration: saving is disabled: \"store\" is not set");
    }
    if (what == SET && !call->values[FILE_NAME].given) {
        return command_fail(call, ERROR_MISSING,
                            "calibration: set requires FILE (\"files\" lists them)");
    }
    if (what != SET && call->values[FILE_NAME].given) {
        return command_fail(call, ERROR_ARGUMENT,
                            "calibration: unexpected FILE \"%s\" (only \"set\" has one)",
                            call->values[FILE_NAME].text);
    }
    return what == SET ? run_set(call) : what == FORGET ? run_forget(call) : run_show(call);
}

static const struct command_argument arguments[] = {
    {.name = "WHAT",
     .kind = COMMAND_CHOICE,
     .choices = "show set forget",
     .optional = true,
     .help = "what to do; default: show"},
    {.name = "FILE",
     .kind = COMMAND_TEXT,
     .min = 1,
     .max = FILES_NAME_MAX,
     .optional = true,
     .help = "calibration to set, one of the instrument's files",
     .candidates = files_candidates_file},
    {.name = CAPTURE_ACCEPT_NAME,
     .kind = COMMAND_FLAG,
     .help = "accept one made with other axes, cameras or windows"},
    {.name = "unit",
     .kind = COMMAND_CHOICE,
     .choices = "mm",
     .help = "accept a baseline below 5 mm"},
};

static const struct command commands[] = {
    {.name = "calibration",
     .summary = "show, set or forget the saved calibration",
     .help = "It is saved across restarts. \"set\" rejects an invalid calibration, and, after a "
             "bring-up, one made with other axes, cameras or windows.",
     .arguments = arguments,
     .argument_count = ARGUMENTS,
     .flags = COMMAND_UNRECORDED,
     .run = run_calibration},
};

const struct command *commands_calibration_table(size_t *count) {
    *count = 1;
    return commands;
}
