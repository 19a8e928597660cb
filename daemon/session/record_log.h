// SPDX-License-Identifier: Apache-2.0
/// What the ports of record.c add to calls.log. Used by record.c only.
#ifndef VERGENCE_DAEMON_SESSION_RECORD_LOG_H
#define VERGENCE_DAEMON_SESSION_RECORD_LOG_H

#include "daemon/session/record.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Whether calls are being recorded.
bool record_is_on(const struct record *self);

/// Adds one call that has just been made, with its results; nothing while not recording.
void record_call(struct record *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/// The time that the instrument's clock shows at `now_us`.
uint64_t record_clock(struct record *self, uint64_t now_us);

/// Copies the pixels and queues them for the disk; `*crc32` is set to the CRC of their file. False:
/// out of memory, which ends the recording.
bool record_frame(struct record *self, const struct hal_camera_frame *frame, uint32_t *crc32);

#ifdef __cplusplus
}
#endif

#endif
