// SPDX-License-Identifier: Apache-2.0
/// `vergence reconstruct`: two images and a calibration in, a directory of results out. The caller
/// provides the readers and writers: fewer on the board than on the host.
#ifndef VERGENCE_DAEMON_SURFACE_RECONSTRUCT_COMMAND_H
#define VERGENCE_DAEMON_SURFACE_RECONSTRUCT_COMMAND_H

#include "daemon/surface/reconstruct_job.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Runs the command and returns its exit code, see client.h.
int reconstruct_command_run(const struct reconstruct_program *program, int argc, char **argv);

#ifdef __cplusplus
}
#endif

#endif
