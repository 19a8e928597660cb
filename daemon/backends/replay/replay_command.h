// SPDX-License-Identifier: Apache-2.0
/// `vergence replay SESSION`: runs a recording again and compares it, on any machine.
#ifndef VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_COMMAND_H
#define VERGENCE_DAEMON_BACKENDS_REPLAY_REPLAY_COMMAND_H

#ifdef __cplusplus
extern "C" {
#endif

/// Runs the command and returns its exit code, see client.h: 0 if everything matched.
int replay_command_run(int argc, char **argv);

#ifdef __cplusplus
}
#endif

#endif
