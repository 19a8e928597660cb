// SPDX-License-Identifier: Apache-2.0
/// `vergence export SESSION --png`: writes recorded pairs as images for people and other programs.
#ifndef VERGENCE_DAEMON_SURFACE_EXPORT_COMMAND_H
#define VERGENCE_DAEMON_SURFACE_EXPORT_COMMAND_H

#ifdef __cplusplus
extern "C" {
#endif

/// Runs the command and returns its exit code, see client.h.
int export_command_run(int argc, char **argv);

#ifdef __cplusplus
}
#endif

#endif
