// SPDX-License-Identifier: Apache-2.0
/// How a recording gets to disk: calls and frames are passed to the disk writer, so that the rig's
/// thread does not wait for the disk. Used by record.c only.
#ifndef VERGENCE_DAEMON_SESSION_RECORD_DISK_H
#define VERGENCE_DAEMON_SESSION_RECORD_DISK_H

#include "daemon/session/record.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The error that ended the recording, described by `last_error`; 0: none.
int record_disk_failed(const struct record *self);

/// Appends to calls.log; at most RECORD_BUFFER_BYTES.
void record_disk_text(struct record *self, const char *text, size_t length);

/// Copies the pixels and queues them for saving; `*crc32` is set to the CRC of their file. False:
/// out of memory, which ends the recording.
bool record_disk_frame(struct record *self, const struct hal_camera_frame *frame, uint32_t *crc32);

/// Queues a command for the session's index.
void record_disk_command(struct record *self, const char *text);

/// Queues everything added so far, with its CRC, without waiting.
void record_disk_send(struct record *self);

/// Waits until everything is on disk, followed by its CRC. Returns as record_disk_failed.
int record_disk_flush(struct record *self);

#ifdef __cplusplus
}
#endif

#endif
