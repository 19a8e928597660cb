// SPDX-License-Identifier: Apache-2.0
/// The pairs of a session: one after the other as events, or all of them as files, for commands
/// that work on pictures.
#ifndef VERGENCE_DAEMON_SESSION_SESSION_PAIRS_H
#define VERGENCE_DAEMON_SESSION_SESSION_PAIRS_H

#include <stdbool.h>
#include <stdint.h>

#include "daemon/base/message.h"
#include "daemon/session/calibration_match.h"
#include "daemon/session/session.h"
#include "daemon/session/session_read.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SESSION_PAIRS_PATH_BYTES = 4096 };

/// A way through a session's pairs. Large: static or allocated; zeroed at the beginning.
struct session_pairs {
    uint32_t count;             // found so far: the place of the last one, from 1
    struct session_event pair;  // that one; its frames were not looked at
    bool has_calibration;       // that was in force then
    uint32_t calibration_crc;
    bool has_instrument;  // the session says what its frames were taken with
    struct session_instrument instrument;

    // Work space.
    struct session_event event;
    bool next_has_calibration;
    uint32_t next_calibration_crc;
};

/// Goes on to the next pair: 1; 0 at the end, and `pair` is the last one still. Errors of
/// session_reader_next, and ERROR_MISSING at the end of a session without any.
int session_pairs_next(struct session_pairs *self, struct session_reader *reader,
                       struct message *message);

/// Finds the pair `number`, from 1 (0: the last one). What comes after it does not count. 0, or
/// errors as above, ERROR_MISSING also when there are not so many.
int session_pairs_find(struct session_pairs *self, struct session_reader *reader, uint32_t number,
                       struct message *message);

/// A pair's files, the left camera's first. Both frames are there and are what was recorded.
struct session_pair_files {
    char path[2][SESSION_PAIRS_PATH_BYTES];
    bool mosaic;                           // the frames are raw: rows of G R and of B G
    struct calibration_match_state state;  // what they were taken with
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
