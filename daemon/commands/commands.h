// SPDX-License-Identifier: Apache-2.0
/// The daemon's commands. Each module commands_NAME.c has a table, commands_NAME_table; the list of
/// the modules is in daemon/CMakeLists.txt.
#ifndef VERGENCE_DAEMON_COMMANDS_COMMANDS_H
#define VERGENCE_DAEMON_COMMANDS_COMMANDS_H

#include <stdbool.h>
#include <stddef.h>

#include "command_modules.h"
#include "console/command.h"
#include "console/pair/zoom_query.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/server/daemon.h"
#include "daemon/session/last_pair.h"
#include "daemon/system/tftp.h"

#define COMMANDS_DECLARE(name) const struct command *commands_##name##_table(size_t *count);
COMMAND_MODULES(COMMANDS_DECLARE)
#undef COMMANDS_DECLARE

/// Name of the calibration's record in the store, and maximum length of its canonical text, of one
/// state or of all zooms.
#define STORE_CALIBRATION "calibration"
enum { STORE_CALIBRATION_BYTES = 384 * 1024 };

/// The rig's commands and those of all modules, by name. Static storage.
struct command_table commands_all(void);

/// Formats the message of a call as by printf, control characters replaced. Returns `error`, < 0.
int command_fail(const struct command_call *call, int error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/// The same for an error of the store: "`subject`: cannot `action` the store PATH: reason", where
/// `action` is "save to", "read from" or "remove from". Returns `error`.
int command_fail_store(const struct command_call *call, int error, const char *subject,
                       const char *action);

/// Access a record of the store (which is not NULL) on the disk writer's thread; the rig is
/// serviced meanwhile. Errors are those of struct hal_store_operations, without a message. The
/// rig's thread.
int commands_store_load(const struct command_call *call, const char *name, char *text,
                        size_t capacity, size_t *length);
int commands_store_save(const struct command_call *call, const char *name, const char *text,
                        size_t length);
int commands_store_remove(const struct command_call *call, const char *name);

/// Runs a command as if a user had entered it, with the answer in `reply` (NULL: none), so that a
/// recording contains it. `line` is valid. Returns its error, with the call's message.
int command_give(const struct command_call *call, const char *line,
                 const struct command_reply *reply);

/// The same with the rig's own command, whatever the daemon makes of its name.
int command_give_rig(const struct command_call *call, const char *line,
                     const struct command_reply *reply);

/// The rig's `bringup`; after success the cameras get the saved settings if the configuration has
/// restore = yes, and the answer reports the outcome. 0, even if nothing was restored;
/// ERROR_CANCELLED; or, if the instrument is no longer ready, its error with the call's message.
int commands_settings_bringup(const struct command_call *call);

/// The rig's `zoom`; with density=, fit= or distance= by the saved calibration of all zooms. The
/// lenses move by the rig's own commands, which a recording contains.
int commands_zoom_run(const struct command_call *call);

/// The saved calibration at the axes of `state`, if it matches. ERROR_MISSING: none is saved;
/// ERROR_MISMATCH and other errors, all with a message.
struct calibration_match_state;
struct calibration;
int commands_calibration_saved(const struct command_call *call,
                               const struct calibration_match_state *state,
                               struct calibration *calibration, struct message *message);

/// What the daemon does for commands that consist of others.
extern const struct command_host commands_host;

struct zoom_calibration;
/// The line of sight of the request's pixel in the last view's picture, if it states one. Fails
/// with a message if there is none, or if the cameras have moved since.
struct measure_request;
struct measure_place;
int commands_view_ray(const struct command_call *call, const struct zoom_calibration *zoom,
                      const struct measure_request *request, struct measure_place *place);

/// Progress and cancellation of a TFTP transfer, as those of the call, which must outlive it.
struct tftp_observer commands_observe_transfer(struct command_call *call);

/// Checks, before there is any data, that a session of this name can be started; nothing if it is
/// not given. 0, or an error with the call's message. The rig's thread only.
int commands_session_check_name(const struct command_call *call, const struct command_value *name);

/// Adds the current recording, if there is one, to the answer of `status`. The rig's thread only.
void commands_session_put_state(const struct command_call *call);

/// Writes a note, a comment ("# measure ..."), into the recording, or, if there is none, into the
/// session `name`, which has ended. 0, or an error with the call's message: the session is as
/// before. The rig's thread only.
int commands_session_note(const struct command_call *call, const char *name, const char *text);

/// Ends the current recording, if there is one, in good order. Only after the rig's thread ended.
void commands_session_end(struct daemon *daemon);

/// Notes for `status` what a pair showed that the saved calibration was adjusted by. Any thread.
struct adjust_report;
void commands_calibration_adjusted(const struct command_call *call,
                                   const struct adjust_report *report);

/// Describes the instrument that takes the pairs. The rig's thread only.
struct pair_instrument;
void commands_calibration_instrument(const struct command_call *call,
                                     struct pair_instrument *instrument);

/// Gives a pair that was just taken its calibration: the saved one, or that of the pair's own axes
/// if a zoom calibration is saved; none (`calibration_length` 0) if none is saved or the zoom
/// calibration does not reach the axes. Returns 0 if none is saved, it matches, or the mismatch is
/// `accepted` or was when it was set, which the answer then says; ERROR_MISMATCH or an error of the
/// store, with the call's message. `captured` has its profile and instrument. The rig's thread
/// only.
int commands_calibration_of_pair(const struct command_call *call, struct captured_pair *captured,
                                 bool accepted);

/// The saved calibration of all zooms, to be freed. With the call's message ERROR_MISSING: none is
/// saved, or one of a single state. `accepted` and other errors as commands_calibration_check_rig.
/// The rig's thread only.
struct zoom_calibration;
int commands_calibration_zoom(const struct command_call *call, struct zoom_calibration **zoom,
                              bool *accepted);

/// The instrument's state as a pair taken now would have it, with the positions last read. The
/// rig's thread only.
struct calibration_match_state;
void commands_calibration_now(const struct command_call *call,
                              struct calibration_match_state *state);

/// Whether the saved calibration is of this instrument and its cameras, as far as they are known
/// (not before the bring-up): 0, ERROR_MISMATCH or another error with the call's message, or
/// ERROR_MISSING without one: none is saved. What does not fit but was accepted when it was set
/// sets `*accepted` (false at first), and the answer says it once. The rig's thread only.
int commands_calibration_check_rig(const struct command_call *call, bool *accepted);

/// Adds the saved calibration, and whether it matches the instrument's present state, to the answer
/// of `status`, with the reason if not. The rig's thread only.
void commands_calibration_put_state(const struct command_call *call);

#endif
