// SPDX-License-Identifier: Apache-2.0
/// Reads a session's directory and trusts nothing in it.
#ifndef VERGENCE_DAEMON_SESSION_SESSION_READ_H
#define VERGENCE_DAEMON_SESSION_SESSION_READ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "daemon/base/message.h"
#include "daemon/session/session.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SESSION_READ_PATH_BYTES = 4096, SESSION_READ_INDEX_MAX_BYTES = 64 << 20 };

struct session_reader {
    char path[SESSION_READ_PATH_BYTES];  // for messages
    int directory;                       // descriptor; -1: closed
    char *text;                          // of the index; allocated
    size_t length, at;
    uint32_t crc;
    int line;    // of the event that was read last, from 1
    bool ended;  // its end was read
    bool cut;    // the session was not closed in order: killed, or still being written
};

/// Opens the session `path`, as openat(2) understands it with the descriptor `parent`, and reads
/// its first event, which says what made it. ERROR_MISSING (no such directory), ERROR_ARGUMENT (no
/// session in it), ERROR_VERSION, ERROR_MEMORY, and those of the next function. `begin` may be
/// NULL. On success the caller closes the reader.
int session_reader_open(struct session_reader *self, int parent, const char *path,
                        struct session_event *begin, struct message *message);

/// The next event: 1, or 0 at the end. A last line that did not become whole counts as never
/// written. ERROR_CRC or ERROR_SYNTAX for a line before the last that is not what was written.
int session_reader_next(struct session_reader *self, struct session_event *event,
                        struct message *message);

/// Whether a frame's file can be what was recorded, by its size and its head: to be asked before
/// there is memory for it, since a session may come from anywhere and claim any size. Errors as of
/// the next function.
int session_reader_frame_fits(const struct session_reader *self, const struct pair_frame *frame,
                              uint32_t crc32, struct message *message);

/// Reads the pixels of a frame (`crc32` and the form in `frame`, from an event) into `data`,
/// `values` long, rows without gaps. ERROR_MEMORY when that is too short, ERROR_MISSING when the
/// file is not there, ERROR_CRC when it is not what was recorded. `data` NULL: it is only checked,
/// and takes no memory.
int session_reader_frame(const struct session_reader *self, const struct pair_frame *frame,
                         uint32_t crc32, uint16_t *data, size_t values, struct message *message);

/// Reads a calibration's text, at most `capacity` bytes. Returns its length, or errors as above.
int session_reader_calibration(const struct session_reader *self, uint32_t crc32, char *text,
                               size_t capacity, struct message *message);

/// Opens a file of the session for reading; NULL with `message` set.
FILE *session_reader_file(const struct session_reader *self, const char *name,
                          struct message *message);

/// Lets go. Harmless for a closed reader.
void session_reader_close(struct session_reader *self);

#ifdef __cplusplus
}
#endif

#endif
