// SPDX-License-Identifier: Apache-2.0
/// Reads the lines of a script on standard input.
#ifndef VERGENCE_DAEMON_CLIENT_REMOTE_SCRIPT_H
#define VERGENCE_DAEMON_CLIENT_REMOTE_SCRIPT_H

#include <stdbool.h>
#include <stddef.h>

#include "console/command.h"
#include "daemon/client/remote.h"

#ifdef __cplusplus
extern "C" {
#endif

enum remote_script_line {
    REMOTE_SCRIPT_LINE,
    REMOTE_SCRIPT_TOO_LONG,  ///< longer than a command may be; not in `line`
    REMOTE_SCRIPT_CONTROL,   ///< contains a zero byte; not in `line`
    REMOTE_SCRIPT_BROKEN,    ///< reading failed, see `errno_of_read`; not in `line`
    REMOTE_SCRIPT_END
};

/// Initialise with zeros.
struct remote_script {
    char data[4096];
    size_t begin, end;  ///< of the bytes read but not yet used
    int errno_of_read;  ///< 0: no error so far
    char line[COMMAND_LINE_MAX + 1];
};

/// Reads the next line, without its end, into `line`; the last line needs no line end. Handles user
/// input meanwhile; REMOTE_SCRIPT_END also when the user interrupts.
enum remote_script_line remote_script_next(struct remote_script *self, struct remote *remote);

#ifdef __cplusplus
}
#endif

#endif
