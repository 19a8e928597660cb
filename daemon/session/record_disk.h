// SPDX-License-Identifier: Apache-2.0
/// How a recording gets to the disk: calls and frames are handed to the scribe, who writes them, so
/// that the thread that has the instrument does not wait for the disk. For record.c alone.
#ifndef VERGENCE_DAEMON_SESSION_RECORD_DISK_H
#define VERGENCE_DAEMON_SESSION_RECORD_DISK_H

#include "daemon/session/record.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Why recording has ended, an error; 0: it goes on. `trouble` says it in words.
int record_disk_failed(const struct record *self);

/// Adds to calls.log; at most RECORD_BUFFER_BYTES.
void record_disk_text(struct record *self, const char *text, size_t length);

/// Copies the pixels and has them saved; `*crc32` will be their file's. False: there is no memory,
/// which ends the recording.
bool record_disk_frame(struct record *self, const struct hal_camera_frame *frame, uint32_t *crc32);

/// Has a command written into the session's index.
void record_disk_command(struct record *self, const char *text);

/// Has what was added so far written, with its CRC, and does not wait for that.
void record_disk_send(struct record *self);

/// Waits until all of it is on the disk, with the CRC behind it. 0, or as record_disk_failed.
int record_disk_flush(struct record *self);

#ifdef __cplusplus
}
#endif

#endif
