// SPDX-License-Identifier: Apache-2.0
/// The lines of a script on standard input.
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
    REMOTE_SCRIPT_TOO_LONG,  ///< longer than a command may be; none of it is in the text
    REMOTE_SCRIPT_CONTROL,   ///< it holds a zero byte; nor is that
    REMOTE_SCRIPT_BROKEN,    ///< it cannot be read on: `errno_of_read` says why; nor is that
    REMOTE_SCRIPT_END
};

/// Zeros to begin with.
struct remote_script {
    char data[4096];
    size_t begin, end;  ///< of what was read and not taken yet
    int errno_of_read;  ///< 0: all went well so far
    char line[COMMAND_LINE_MAX + 1];
};

/// Takes the next line, without its end, into `line`; the last one may lack its end. Attends to the
/// user while there is none: REMOTE_SCRIPT_END also when he interrupts.
enum remote_script_line remote_script_next(struct remote_script *self, struct remote *remote);

#ifdef __cplusplus
}
#endif

#endif
