// SPDX-License-Identifier: Apache-2.0
/// The instrument of a recording, which its index tells whole: no file of the one that recorded it
/// is needed.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_PROFILE_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_PROFILE_H

#include "daemon/base/message.h"
#include "daemon/settings/config.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Sets the profile of `config`, and nothing else there, to that of the session `path` (see
/// session_reader_open): the one of its name, which may be a built-in one or one of its own, with
/// the settings that come before its first command. 0; what session_reader_open and
/// session_reader_next return; ERROR_SYNTAX, ERROR_ARGUMENT, ERROR_RANGE for a setting that is none
/// of an instrument, ERROR_MISSING for a name that says nothing, ERROR_MEMORY. With a message;
/// `config` is untouched then.
int replay_profile(int parent, const char *path, struct config *config, struct message *message);

#ifdef __cplusplus
}
#endif

#endif
