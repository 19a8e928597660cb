// SPDX-License-Identifier: Apache-2.0
/// The daemon's own commands, as tables: help, version, config, log, watch, quit; calibration;
/// settings; files, fetch; send; bugreport; reconstruct; capture, record; snapshot; system.
#ifndef VERGENCE_DAEMON_COMMANDS_COMMANDS_DAEMON_H
#define VERGENCE_DAEMON_COMMANDS_COMMANDS_DAEMON_H

#include <stdbool.h>
#include <stddef.h>

#include "console/command.h"

#ifdef __cplusplus
extern "C" {
#endif

const struct command *commands_daemon_table(size_t *count);
const struct command *commands_calibration_table(size_t *count);
const struct command *commands_files_table(size_t *count);
const struct command *commands_bugreport_table(size_t *count);
const struct command *commands_send_table(size_t *count);
const struct command *commands_reconstruct_table(size_t *count);
const struct command *commands_session_table(size_t *count);
const struct command *commands_snapshot_table(size_t *count);
const struct command *commands_settings_table(size_t *count);
const struct command *commands_system_table(size_t *count);

/// Once `bringup` has worked: sets the cameras as the kept settings say, if the daemon's settings
/// want that, and tells in the answer whether it did. 0, also when the instrument was left as it
/// is; else the error, with the call's message, of an instrument that is not ready any more, or
/// ERROR_CANCELLED.
int commands_settings_after_bringup(const struct command_call *call);

/// The session that a pair went into last. False: there was none yet. Any thread.
bool commands_session_last(char *name, size_t bytes);

/// What `status` is to say of the recording that is under way, if one is. The rig's thread only.
void commands_session_put_state(const struct command_call *call);

/// What the instrument takes pairs with. The rig's thread only.
struct session_instrument;
void commands_calibration_instrument(const struct command_call *call,
                                     struct session_instrument *instrument);

/// Compares the kept calibration with `state`: 0 when none is kept, or it fits; ERROR_MISMATCH with
/// `message`, `accept` as for `calibration_match`; errors of the store. The rig's thread only.
struct calibration_match_state;
struct message;
int commands_calibration_match(const struct command_call *call,
                               const struct calibration_match_state *state, const char *accept,
                               struct message *message);
/// What `status` is to say of the kept calibration: which, and whether it fits the instrument as it
/// stands. 0, or ERROR_MISMATCH with the call's message. The rig's thread only.
int commands_calibration_put_state(const struct command_call *call);

/// Ends a recording that is under way, in good order, when nobody has the rig any more.
struct hal_log;
struct record;
void commands_session_end(struct record *record, const struct hal_log *log);

#ifdef __cplusplus
}
#endif

#endif
