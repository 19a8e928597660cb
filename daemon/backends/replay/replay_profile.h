// SPDX-License-Identifier: Apache-2.0
/// The instrument of a recording. The session index describes it completely: no other file is
/// needed.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_PROFILE_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_PROFILE_H

#include "daemon/base/message.h"
#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Sets the profile of `config`, and nothing else, to that of the session `path` (see
/// session_reader_open): the profile of its name, built-in or custom, with the settings that
/// precede the first command. 0; errors of session_reader_open and session_reader_next;
/// ERROR_SYNTAX, ERROR_ARGUMENT, ERROR_RANGE for a setting that is not an instrument setting,
/// ERROR_MISSING for an undefined profile name, ERROR_MEMORY. Errors set a message and leave
/// `config` unchanged.
int replay_profile(int parent, const char *path, struct config *config, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
