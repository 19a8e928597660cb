// SPDX-License-Identifier: Apache-2.0
/// Reads a session's directory without trusting its contents.
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
    char path[SESSION_READ_PATH_BYTES];  // path of the session, for messages
    int directory;                       // descriptor; -1: closed
    char *text;                          // contents of the index; allocated
    size_t length, at;
    uint32_t crc;
    int line;    // line of the last event, from 1
    bool ended;  // the END event was read
    bool cut;    // not closed properly: killed, or still being written
};

/// Opens the session `path` (relative to the descriptor `parent` as in openat(2)) and reads its
/// first event into `begin` (may be NULL), which names the build that recorded it. ERROR_MISSING
/// (no such directory), ERROR_ARGUMENT (no session in it), ERROR_VERSION, ERROR_MEMORY, and errors
/// of session_reader_next. On success the caller closes the reader.
int session_reader_open(struct session_reader *self, int parent, const char *path,
                        struct session_event *begin, struct message *message);

/// Reads the next event: 1, or 0 at the end. An incomplete last line counts as never written.
/// ERROR_CRC or ERROR_SYNTAX if an earlier line is damaged.
int session_reader_next(struct session_reader *self, struct session_event *event,
                        struct message *message);

/// Goes back to the event after the first one.
void session_reader_rewind(struct session_reader *self);

/// Reads the pixels of an image (`crc32` and the format in `image`, from an event) into memory that
/// raw_image_release frees; rows without gaps. A session may come from anywhere and claim any size:
/// the file's own size and header are checked first. ERROR_MEMORY, ERROR_MISSING if the file does
/// not exist, ERROR_CRC if it is not what was recorded; the image has no pixels then.
int session_reader_load(const struct session_reader *self, struct raw_image *image, uint32_t crc32,
                        struct message *message);

/// Whether that would succeed, without memory for the image.
int session_reader_check(const struct session_reader *self, const struct raw_image *image,
                         uint32_t crc32, struct message *message);

/// Reads a calibration's text, at most `capacity` bytes. Returns its length, or errors as above.
int session_reader_zoom_calibration(const struct session_reader *self, uint32_t crc32, char *text,
                                    size_t capacity, struct message *message);
int session_reader_calibration(const struct session_reader *self, uint32_t crc32, char *text,
                               size_t capacity, struct message *message);

/// Opens a file of the session for reading; NULL with `message` set.
FILE *session_reader_file(const struct session_reader *self, const char *name,
                          struct message *message);

/// Closes the reader. Allowed for a closed reader.
void session_reader_close(struct session_reader *self);

#ifdef __cplusplus
}
#endif

#endif
