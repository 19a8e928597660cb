// SPDX-License-Identifier: Apache-2.0
/// The pairs of a session as files, for commands that work on pictures.
#ifndef VERGENCE_DAEMON_SESSION_PAIRS_H
#define VERGENCE_DAEMON_SESSION_PAIRS_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SESSION_PAIRS_PATH_BYTES = 4096 };

/// A pair, the left camera's first. Both frames are there and are what was recorded.
struct session_pair_files {
    char path[2][SESSION_PAIRS_PATH_BYTES];
    char calibration[SESSION_PAIRS_PATH_BYTES];  // that was in force; "": none
    bool mosaic;                                 // the frames are raw: rows of G R and of B G
};

/// Whether `path` is a directory with a session in it, good or damaged.
bool session_pairs_here(const char *path);

/// Gives every pair of the session in `path` to `each`, in the order in which they were taken.
/// Returns how many, or ERROR_MISSING (none, or a frame's file is not there), ERROR_CRC, and those
/// of session_reader_open and session_reader_next; `message` names the session then.
int session_pairs_read(const char *path,
                       void (*each)(void *self, const struct session_pair_files *files), void *self,
                       struct message *message);

#ifdef __cplusplus
}
#endif

#endif
