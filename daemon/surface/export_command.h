// SPDX-License-Identifier: Apache-2.0
/// `vergence export SESSION`: writes recorded pairs as images for people and other programs, or as
/// a recording for others.
#ifndef VERGENCE_DAEMON_SURFACE_EXPORT_COMMAND_H
#define VERGENCE_DAEMON_SURFACE_EXPORT_COMMAND_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

struct export_recording {
    const char *session, *file;
    const char *result;       // directory of a result of one of the pairs; NULL: none
    const char *calibration;  // file; NULL: the pairs' own
    uint32_t pair;            // number of the only one; 0: all
    bool compressed, quiet;
};

/// Writes a session as one file for other programs. Returns the command's exit code, with `message`
/// set unless it is CLIENT_OK.
typedef int export_recording_writer(const struct export_recording *request,
                                    struct message *message);

/// Runs the command and returns its exit code, see client.h. `write_recording` NULL: there is no
/// --mcap.
int export_command_run(int argc, char **argv, export_recording_writer *write_recording);

#ifdef __cplusplus
}
#endif

#endif
