// SPDX-License-Identifier: Apache-2.0
/// The rig's own commands: what the files commands_*.c contribute to the table in commands_table.c,
/// and what they share.
#ifndef VERGENCE_CONSOLE_COMMANDS_H
#define VERGENCE_CONSOLE_COMMANDS_H

#include "console/command.h"
#include "console/command_text.h"
#include "focus/depth_iris.h"
#include "rig/base/rig_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Choices of an argument that selects cameras, as bits RIG_LEFT and RIG_RIGHT.
#define COMMANDS_SIDES "left right both"
/// The sides of an optional COMMANDS_SIDES argument; both if it was left out.
unsigned commands_sides(const struct command_value *value);
/// "left", "right". Static storage.
const char *commands_side_name(unsigned side);

/// Starts the error text in the call's message.
struct command_text commands_sentence(const struct command_call *call);
/// Rejects a command of this name because the rig is not RIG_READY; the message says why and what
/// to do.
int commands_not_ready(const struct command_call *call, const char *name);

/// Name of the command that brings the instrument up.
#define COMMANDS_BRINGUP "bringup"

int commands_state_status(const struct command_call *call);
int commands_state_health(const struct command_call *call);
int commands_state_bringup(const struct command_call *call);
int commands_state_safe(const struct command_call *call);
int commands_state_wait(const struct command_call *call);

int commands_selftest_run(const struct command_call *call);

int commands_aim_pan(const struct command_call *call);

/// Arguments of `zoom`. The rig's own command has no calibration, and refuses all but POSITION,
/// side and right.
enum commands_zoom_argument {
    COMMANDS_ZOOM_POSITION,
    COMMANDS_ZOOM_SIDE,
    COMMANDS_ZOOM_RIGHT,
    COMMANDS_ZOOM_DENSITY,
    COMMANDS_ZOOM_FIT,
    COMMANDS_ZOOM_DISTANCE,
    COMMANDS_ZOOM_SHARP,
    COMMANDS_ZOOM_PLAN,
    COMMANDS_ZOOM_ARGUMENTS
};
#define COMMANDS_ZOOM "zoom"

/// Show or move an axis. Arguments POSITION, side, right and those of the axis.
int commands_axis_zoom(const struct command_call *call);
int commands_axis_iris(const struct command_call *call);
/// What decides how far an iris is closed for a range. Static storage.
const char *commands_iris_text(enum depth_iris_limit limit);
int commands_focus_run(const struct command_call *call);
/// The position that was typed for a side of `zoom`, `focus` or `iris`.
const struct command_value *commands_axis_typed(const struct command_call *call, unsigned side);
/// Refuses `right` without a position of the left lens, or with a side.
int commands_axis_check_right(const struct command_call *call, unsigned sides);
/// The same for one axis of the lenses.
int commands_axis_run(const struct command_call *call, enum lens_axis axis);
int commands_lens_run(const struct command_call *call);
/// Units of POSITION; the indexes are those of enum commands_lens_unit.
#define COMMANDS_ZOOM_UNITS "counts x mm"
#define COMMANDS_FOCUS_UNITS "counts mm"
#define COMMANDS_IRIS_UNITS "counts f/"
/// What the command lens does.
#define COMMANDS_LENS_ACTIONS "status learned forget"
/// The sides meant by a side option: if none was named, all that have a lens.
int commands_axis_sides(const struct command_call *call, const struct command_value *side,
                        unsigned *sides);
/// Adds what a position of a lens means in mm, x or f-number, where that is known; and a distance,
/// which may be infinite.
void commands_lens_meaning(const struct command_call *call, unsigned side, enum lens_axis axis,
                           int32_t position);
void commands_lens_distance(const struct command_call *call, const char *key, double distance_mm);

int commands_exposure_run(const struct command_call *call);
int commands_exposure_gain(const struct command_call *call);
int commands_window_run(const struct command_call *call);

/// Reads an option X,Y,W,H in px, with W and H from `min_px` to `max_px`; `*region_px` has no width
/// if it was not given. 0, or ERROR_RANGE with a message.
int commands_region(const struct command_call *call, const struct command_value *value, int min_px,
                    int max_px, struct rig_rectangle *region_px);
int commands_focus_auto(const struct command_call *call);
int commands_exposure_auto(const struct command_call *call);

int commands_registers_run(const struct command_call *call);
/// Adds the names of the registers of the chosen device.
void commands_registers_candidates(const struct command_candidates *to);

#ifdef __cplusplus
}
#endif

#endif
