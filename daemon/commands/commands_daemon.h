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

/// After a successful `bringup`: sets the cameras to the saved settings if the configuration has
/// restore = yes, and reports the outcome in the answer. 0, even if nothing was restored;
/// ERROR_CANCELLED; or, if the instrument is no longer ready, its error with the call's message.
int commands_settings_after_bringup(const struct command_call *call);

/// Copies the name of the session that received the last pair. False: no pair yet. Any thread.
bool commands_session_last(char *name, size_t bytes);

/// Adds the current recording, if there is one, to the answer of `status`. The rig's thread only.
void commands_session_put_state(const struct command_call *call);

/// Describes the instrument that takes the pairs. The rig's thread only.
struct session_instrument;
void commands_calibration_instrument(const struct command_call *call,
                                     struct session_instrument *instrument);

/// Compares the saved calibration with `state`: 0 if none is saved or it matches; ERROR_MISMATCH
/// with `message`, `accept` as for `calibration_match`; errors of the store. The rig's thread only.
struct calibration_match_state;
struct message;
int commands_calibration_match(const struct command_call *call,
                               const struct calibration_match_state *state, const char *accept,
                               struct message *message);
/// Adds the saved calibration, and whether it matches the instrument's present state, to the answer
/// of `status`. 0, or ERROR_MISMATCH with the call's message. The rig's thread only.
int commands_calibration_put_state(const struct command_call *call);

/// Ends the current recording, if there is one, in good order. Only after the rig's thread ended.
struct hal_log;
struct record;
void commands_session_end(struct record *record, const struct hal_log *log);

#ifdef __cplusplus
}
#endif

#endif
