// SPDX-License-Identifier: Apache-2.0
// Command window.
#include "console/commands.h"
#include "core/error.h"
#include "core/invariant.h"
#include "rig/rig.h"

// Arguments of `window`.
enum { WINDOW_WIDTH, WINDOW_HEIGHT, WINDOW_SKIP, WINDOW_COLUMN, WINDOW_ROW, WINDOW_SIDE };

// Whether the sensors behind the bridge support this window size in one direction.
static int check_size(const struct command_call *call, unsigned which, const char *name,
                      int64_t skip, int32_t all_px) {
    enum { MIN_PX = 16 };
    const int64_t size_px = call->values[which].integer;
    const int64_t step_px = 2 * skip;
    const int64_t min_px = (MIN_PX + step_px - 1) / step_px * step_px;
    const int64_t max_px = all_px / step_px * step_px;
    if (size_px >= min_px && size_px <= max_px && size_px % step_px == 0) {
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_join(&sentence, "window: ", name, " ");
    command_text_add_integer(&sentence, size_px);
    command_text_add(&sentence, " is not supported (expected with skip=");
    command_text_add_integer(&sentence, skip);
    command_text_add(&sentence, ": ");
    command_text_add_integer(&sentence, min_px);
    command_text_add(&sentence, " to ");
    command_text_add_integer(&sentence, max_px);
    command_text_add(&sentence, " px in steps of ");
    command_text_add_integer(&sentence, step_px);
    command_text_add(&sentence, ")");
    return ERROR_RANGE;
}

// Where the window begins in one direction, which must be on the sensor; without the option it is
// centred.
static int check_start(const struct command_call *call, unsigned which, const char *name,
                       int64_t size_px, int32_t all_px, uint16_t *start_px) {
    const int64_t max_px = all_px - size_px;
    const int64_t wanted_px =
        call->values[which].given ? call->values[which].integer : max_px / 4 * 2;
    if (wanted_px <= max_px && wanted_px % 2 == 0) {
        INVARIANT(wanted_px >= 0);
        *start_px = (uint16_t)wanted_px;
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_join(&sentence, "window: ", name, "=");
    command_text_add_integer(&sentence, wanted_px);
    command_text_add(&sentence, " is not supported (expected with this size: 0 to ");
    command_text_add_integer(&sentence, max_px);
    command_text_add(&sentence, " px in steps of 2)");
    return ERROR_RANGE;
}

// The window of one side can be moved, but has the size of the other one.
static int check_side(const struct command_call *call, const struct rig_rectangle *where_px,
                      int64_t skip) {
    const unsigned sides = commands_sides(&call->values[WINDOW_SIDE]);
    const struct mt9t001_window *other =
        &call->rig->camera[sides == 1u << RIG_LEFT ? RIG_RIGHT : RIG_LEFT].sensor.window;
    if (sides == (1u << RIG_LEFT | 1u << RIG_RIGHT) ||
        (where_px->width_px == other->width_px && where_px->height_px == other->height_px &&
         skip == other->skip)) {
        return ERROR_OK;
    }
    struct command_text sentence = commands_sentence(call);
    command_text_add(&sentence, "window: the other side has ");
    command_text_add_integer(&sentence, other->width_px);
    command_text_add(&sentence, " ");
    command_text_add_integer(&sentence, other->height_px);
    command_text_add(&sentence, " skip=");
    command_text_add_integer(&sentence, other->skip);
    command_text_add(&sentence, ", and both have the same size (leave side out to change both)");
    return ERROR_RANGE;
}

static int set_sensor_windows(const struct command_call *call, int64_t skip) {
    struct rig_rectangle where_px = {.column_px = 0};
    int error = check_size(call, WINDOW_WIDTH, "WIDTH", skip, MT9T001_WIDTH_PX);
    if (error == ERROR_OK) {
        error = check_size(call, WINDOW_HEIGHT, "HEIGHT", skip, MT9T001_HEIGHT_PX);
    }
    if (error != ERROR_OK) {
        return error;
    }
    where_px.width_px = (uint16_t)call->values[WINDOW_WIDTH].integer;
    where_px.height_px = (uint16_t)call->values[WINDOW_HEIGHT].integer;
    error = check_start(call, WINDOW_COLUMN, "column", where_px.width_px, MT9T001_WIDTH_PX,
                        &where_px.column_px);
    if (error == ERROR_OK) {
        error = check_start(call, WINDOW_ROW, "row", where_px.height_px, MT9T001_HEIGHT_PX,
                            &where_px.row_px);
    }
    error = error == ERROR_OK ? check_side(call, &where_px, skip) : error;
    return error != ERROR_OK ? error
                             : rig_window_at(call->rig, commands_sides(&call->values[WINDOW_SIDE]),
                                             &where_px, (uint8_t)skip);
}

// Cameras with their own ports have sizes, and nothing else.
static int set_size(const struct command_call *call, int64_t skip) {
    static const char *const names[] = {[WINDOW_SKIP] = "skip",
                                        [WINDOW_COLUMN] = "column",
                                        [WINDOW_ROW] = "row",
                                        [WINDOW_SIDE] = "side"};
    for (unsigned which = WINDOW_SKIP; which <= WINDOW_SIDE; which++) {
        if (call->values[which].given && !(which == WINDOW_SKIP && skip == 1)) {
            struct command_text sentence = commands_sentence(call);
            command_text_join(&sentence, "window: cameras without a bridge have no ", names[which],
                              " (leave it out)");
            return ERROR_UNSUPPORTED;
        }
    }
    return rig_window(call->rig, (uint16_t)call->values[WINDOW_WIDTH].integer,
                      (uint16_t)call->values[WINDOW_HEIGHT].integer, 1);
}

static void show_window(const struct command_call *call) {
    const struct rig *rig = call->rig;
    reply_number(call, "width", rig->format.width_px, 0, "px");
    reply_number(call, "height", rig->format.height_px, 0, "px");
    for (unsigned side = 0; side < RIG_SIDES && rig->profile.bridge; side++) {
        reply_group_begin(call, commands_side_name(side), false);
        reply_number(call, "column", rig->camera[side].sensor.window.column_px, 0, "px");
        reply_number(call, "row", rig->camera[side].sensor.window.row_px, 0, "px");
        reply_group_end(call);
    }
}

int commands_window_run(const struct command_call *call) {
    const struct command_value *values = call->values;
    int error = ERROR_OK;
    const bool placed = values[WINDOW_COLUMN].given || values[WINDOW_ROW].given ||
                        values[WINDOW_SKIP].given || values[WINDOW_SIDE].given;
    if (values[WINDOW_WIDTH].given ? !values[WINDOW_HEIGHT].given : placed) {
        struct command_text sentence = commands_sentence(call);
        command_text_join(&sentence, "window: ", values[WINDOW_WIDTH].given ? "HEIGHT" : "WIDTH",
                          " is missing (expected WIDTH HEIGHT [skip=N] [column=N] [row=N])");
        return ERROR_MISSING;
    }
    if (values[WINDOW_WIDTH].given) {
        const int64_t skip = values[WINDOW_SKIP].given ? values[WINDOW_SKIP].integer : 1;
        INVARIANT(skip >= 1 && skip <= UINT8_MAX);
        error = call->rig->profile.bridge ? set_sensor_windows(call, skip) : set_size(call, skip);
    }
    if (error == ERROR_OK) {
        show_window(call);
    }
    return error;
}
